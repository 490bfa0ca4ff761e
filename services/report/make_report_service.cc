#include "services/report/make_report_service.h"

#include "services/report/model_evaluator.h"
#include "services/report/report_service.h"

namespace forgescan {
namespace {

struct Program {
  std::unique_ptr<ModelEvaluator> evaluator;
  std::shared_ptr<ReportService> service;  // after the evaluator: it goes first
};

}  // namespace

Result<std::shared_ptr<void>> MakeReportService(const ServiceParts& parts) {
  const Station& station = parts.station;
  ASSIGN_OR_RETURN(const ReportConfig config, ReportConfig::Load(station.file.Table("report")));
  auto program = std::make_shared<Program>();
  ASSIGN_OR_RETURN(program->evaluator,
                   ModelEvaluator::Load(station.model, station.features, config.dimensions));
  const ReportStation shown{station.name,
                            FORGESCAN_VERSION,
                            station.file.hash(),
                            station.results,
                            {kServiceNames.begin(), kServiceNames.end()}};
  ASSIGN_OR_RETURN(program->service,
                   ReportService::Create(parts.hub, parts.monitor, config, shown, *program->evaluator));
  return std::shared_ptr<void>(program);
}

}  // namespace forgescan
