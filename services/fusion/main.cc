// forgescan-fusion --station FOLDER
#include "services/common/service/run_service.h"
#include "services/fusion/make_fusion_service.h"

int main(int argc, char** argv) {
  return forgescan::RunService("fusion", argc, argv, forgescan::MakeFusionService);
}
