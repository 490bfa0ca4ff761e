#include "services/registration/make_registration_service.h"

#include "services/common/model/bundle_file.h"
#include "services/registration/registration_service.h"

namespace forgescan {

Result<std::shared_ptr<void>> MakeRegistrationService(const ServiceParts& parts) {
  ASSIGN_OR_RETURN(RegistrationConfig config,
                   RegistrationConfig::Load(parts.station.file.Table("registration")));
  ASSIGN_OR_RETURN(const ModelBundle bundle, ReadBundle(parts.station.model));
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(bundle));
  return std::shared_ptr<void>(
      std::make_shared<RegistrationService>(parts.hub, parts.monitor, std::move(config), std::move(model)));
}

}  // namespace forgescan
