// forgescan-report --station FOLDER
#include "services/common/service/run_service.h"
#include "services/report/make_report_service.h"

int main(int argc, char** argv) {
  return forgescan::RunService("report", argc, argv, forgescan::MakeReportService);
}
