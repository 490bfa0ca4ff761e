// forgescan-reconstruction --station FOLDER
#include "services/common/service/run_service.h"
#include "services/reconstruction/make_reconstruction_service.h"

int main(int argc, char** argv) {
  return forgescan::RunService("reconstruction", argc, argv, forgescan::MakeReconstructionService);
}
