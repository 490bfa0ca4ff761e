#include "services/common/model/bundle_file.h"
#include "services/common/service/run_service.h"
#include "services/registration/registration_service.h"

namespace forgescan {
namespace {

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  ASSIGN_OR_RETURN(RegistrationConfig config,
                   RegistrationConfig::Load(context.station.file.Table("registration")));
  ASSIGN_OR_RETURN(const ModelBundle bundle, ReadBundle(context.station.model));
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(bundle));
  return std::shared_ptr<void>(std::make_shared<RegistrationService>(context.hub, context.monitor,
                                                                     std::move(config), std::move(model)));
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("registration", argc, argv, forgescan::Make); }
