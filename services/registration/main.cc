// forgescan-registration --station FOLDER
#include "services/common/service/run_service.h"
#include "services/registration/make_registration_service.h"

int main(int argc, char** argv) {
  return forgescan::RunService("registration", argc, argv, forgescan::MakeRegistrationService);
}
