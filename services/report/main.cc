// forgescan-report --station FOLDER
#include "services/common/service/run_service.h"
#include "services/report/model_evaluator.h"
#include "services/report/report_service.h"

namespace forgescan {
namespace {

struct Program {
  std::unique_ptr<ModelEvaluator> evaluator;
  std::shared_ptr<ReportService> service;  // after the evaluator: it goes first
};

Result<std::shared_ptr<void>> Make(const ServiceContext& context) {
  const Station& station = context.station;
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
                   ReportService::Create(context.hub, context.monitor, config, shown, *program->evaluator));
  return std::shared_ptr<void>(program);
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) { return forgescan::RunService("report", argc, argv, forgescan::Make); }
