// forgescan inspect: parts on the virtual station, from the empty cell to the report.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <set>

#include "services/common/bus/stream_hub.h"
#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/standing/empty_cell.h"
#include "tools/forgescan/station/interrupt.h"
#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/run_outcome.h"
#include "tools/forgescan/station/station_runner.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kReadyPatienceUs = 60'000'000;
constexpr std::int64_t kPagePatienceUs =
    10'000'000;  // the report service itself waits no longer than half of it

constexpr int kPreparingThreads = 2;

struct InspectOptions {
  int parts = 1;
  std::string station = "stations/virtual";
  std::string out = "runs";
  std::string cell = "cell.toml";
  double takt_s = 45.0;
  int scale_divisor = 0;  // 0: as the cell file says
  ModelImportOptions model;
  double part_patience_s = 300.0;
};

// Without an error if nobody reads it any more: the parts in work are still inspected.
void Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

// The outcome of every part, in the order of the verdicts.
class Progress {
 public:
  Progress(StreamHub& hub) : start_us_(hub.bus().NowUs()), hub_(hub) {
    hub.Subscribe<fsmsg::part_arrived_t>(
        kPartArrived, [this](const auto& m) { Say(m.part, "in place, {} views", m.view_count); });
    hub.Subscribe<fsmsg::view_captured_t>(kViewCaptured, [this](const auto& m) {
      const bool captured = m.status == fsmsg::view_captured_t::STATUS_CAPTURED;
      Say(m.part, "view {} {}", m.view, captured ? "captured" : "VOID: " + m.reason);
    });
    hub.Subscribe<fsmsg::view_result_t>(kViewResult, [this](const auto& m) {
      const bool ok = m.status == fsmsg::view_result_t::STATUS_OK;
      Say(m.part, "view {} {}", m.view, ok ? fmt::format("{} points", m.points) : "VOID: " + m.reason);
    });
    hub.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& m) {
      Say(m.part, "scan {}", m.reason.empty() ? "complete" : "ABORTED: " + m.reason);
    });
    hub.Subscribe<fsmsg::registration_t>(kRegistration, [this](const auto& m) {
      const bool ok = m.status == fsmsg::registration_t::STATUS_CONVERGED;
      Say(m.part, "registration {}",
          ok ? fmt::format("rms {:.3f} mm, {:.0f} % foreign points", m.rms_mm, 100 * m.foreign_share)
             : "FAILED: " + m.reason);
    });
    hub.Subscribe<fsmsg::verdict_t>(kVerdict, [this](const auto& m) { NoteVerdict(m); });
    hub.Subscribe<fsmsg::part_sorted_t>(kPartSorted, [this](const auto& m) { NoteSorted(m); });
  }

  const std::vector<fsmsg::verdict_t>& verdicts() const { return verdicts_; }
  // Parts about which the robot service has said its last word: the line has sorted them, or has not.
  int sorted() const { return static_cast<int>(sorted_.size()); }
  int not_sorted() const { return not_sorted_; }
  double Seconds() const { return static_cast<double>(hub_.bus().NowUs() - start_us_) * 1e-6; }

 private:
  void NoteSorted(const fsmsg::part_sorted_t& m) {
    sorted_.insert(m.part);
    if (m.acknowledged == 0) {
      ++not_sorted_;
      Say(m.part, "NOT SORTED: {}", m.reason);
    }
  }
  // A verdict is said again where a service that was started anew may have missed it.
  void NoteVerdict(const fsmsg::verdict_t& m) {
    const bool again = std::any_of(verdicts_.begin(), verdicts_.end(), [&m](const auto& earlier) {
      return earlier.part == m.part && earlier.utime == m.utime;
    });
    if (!again) {
      Say(m.part, "verdict {}{}{}", VerdictName(m.verdict), m.reason.empty() ? "" : ": ", m.reason);
      verdicts_.push_back(m);
    }
  }
  static const char* VerdictName(int verdict) {
    constexpr const char* kNames[] = {"UNKNOWN", "OK", "NOT_OK", "NOT_DECIDABLE", "NOT_INSPECTED"};
    return verdict >= 0 && verdict < 5 ? kNames[verdict] : "UNKNOWN";
  }
  template <typename... Args>
  void Say(int part, fmt::format_string<Args...> format, Args&&... args) {
    const double since_s = static_cast<double>(hub_.bus().NowUs() - start_us_) * 1e-6;
    Print(fmt::format("{:7.2f} s  part {}  {}\n", since_s, part,
                      fmt::format(format, std::forward<Args>(args)...)));
  }

  std::int64_t start_us_;
  StreamHub& hub_;
  std::vector<fsmsg::verdict_t> verdicts_;
  std::set<int> sorted_;  // parts
  int not_sorted_ = 0;
};

Result<fs::path> MakeRunFolder(const std::string& base) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  char name[32];
  std::strftime(name, sizeof name, "%Y%m%d-%H%M%S", std::gmtime(&now));
  for (int attempt = 0; attempt < 100; ++attempt) {
    const fs::path folder =
        fs::absolute(fs::path(base) / (attempt == 0 ? name : fmt::format("{}-{}", name, attempt)));
    std::error_code problem;
    if (fs::create_directories(folder, problem)) {
      return folder;
    }
    if (problem) {
      return Fail(ErrorCode::kIo, "{} cannot be made: {}", folder.string(), problem.message());
    }
  }
  return Fail(ErrorCode::kIo, "no new folder can be made in {}", base);
}

// What is not written by then, the report service writes when it is stopped.
Status WaitForPages(StationRunner& runner, const Progress& progress) {
  const std::int64_t until_us = runner.bus().NowUs() + kPagePatienceUs;
  while (!PagesAreWritten(runner.station().results, progress.verdicts()) && runner.bus().NowUs() < until_us) {
    RETURN_IF_ERROR(runner.RunFor(100'000));
  }
  return {};
}

// Returns when the line has sorted every part, and their pages are written.
Status InspectParts(StationRunner& runner, ProcessGroup& cell, const InspectOptions& options,
                    const fs::path& run, const Progress& progress) {
  const Interrupt interrupt;
  if (const int bytes = runner.bus().Health().receive_buffer_bytes; bytes < kWantedReceiveBufferBytes) {
    Print(fmt::format(
        "note: the bus has receive buffers of {:.1f} MB, {:.0f} MB are wanted; what is lost is sent again "
        "(sysctl "
        "net.core.rmem_max={} avoids it)\n",
        bytes * 1e-6, kWantedReceiveBufferBytes * 1e-6, kWantedReceiveBufferBytes / 2));
  }
  RETURN_IF_ERROR(
      cell.Start("virtual_station",
                 {ProgramFolder() + "/forgescan-virtual-station", "run", "--run", run.string(), "--parts",
                  std::to_string(options.parts), "--takt-s", std::to_string(options.takt_s)}));
  RETURN_IF_ERROR(runner.WaitUntilReady(kReadyPatienceUs));
  cell.Signal(SIGUSR1);  // the line starts
  const auto patience_us = static_cast<std::int64_t>(options.part_patience_s * 1e6) * options.parts;
  const std::int64_t until_us = runner.bus().NowUs() + patience_us;
  while (progress.sorted() < options.parts) {
    RETURN_IF_ERROR(runner.RunFor(100'000));
    if (interrupt.Requested()) {
      return Fail(ErrorCode::kUnavailable, "interrupted");
    }
    if (runner.bus().NowUs() > until_us) {
      return Fail(ErrorCode::kTimeout, "{} of {} parts were sorted within {} s; {} has the logs",
                  progress.sorted(), options.parts, patience_us / 1'000'000, run.string());
    }
    if (const auto ended = cell.Ended(); ended.has_value() && progress.sorted() < options.parts) {
      return Fail(ErrorCode::kUnavailable, "{} {}", ended->service, ended->Text());
    }
  }
  RETURN_IF_ERROR(WaitForPages(runner, progress));
  Print(fmt::format("\n{}\ninspection took {:.0f} s, {} restarts\n", runner.Table(140, false),
                    progress.Seconds(), runner.restarts()));
  return {};
}

Status Prepare(const InspectOptions& options, const fs::path& run) {
  ProcessGroup prepare((run / "log").string());
  std::vector<std::string> command{ProgramFolder() + "/forgescan-virtual-station",
                                   "prepare",
                                   "--station",
                                   options.station,
                                   "--cell",
                                   options.cell,
                                   "--run",
                                   run.string()};
  if (options.scale_divisor != 0) {
    command.insert(command.end(), {"--scale-divisor", std::to_string(options.scale_divisor)});
  }
  RETURN_IF_ERROR(prepare.Start("virtual_station_prepare", command));
  RETURN_IF_ERROR(prepare.WaitForSuccess());
  ASSIGN_OR_RETURN(const Station station, Station::Load((run / "station").string()));
  ASSIGN_OR_RETURN(const CellConfig cell, LoadCellConfig((run / "cell.toml").string()));
  RETURN_IF_ERROR(WriteStandingOf(cell, (run / "station").string(), kPreparingThreads));
  ASSIGN_OR_RETURN(const ModelBundle model,
                   LoadModel(run / "station" / "model" / "axle.step", options.model));
  return WriteBundle(model, station.model);
}

Status Inspect(const InspectOptions& options) {
  RETURN_IF_ERROR(EnsureNetwork(options.station));
  ASSIGN_OR_RETURN(const fs::path run, MakeRunFolder(options.out));
  RETURN_IF_ERROR(Prepare(options, run));
  ProcessGroup cell((run / "log").string());
  ASSIGN_OR_RETURN(const auto runner, StationRunner::Create((run / "station").string(), Echo::kTroubles));
  StreamHub hub(runner->bus(), "inspect");  // listens until the bus is silent
  const Progress progress(hub);
  const Status inspected = InspectParts(*runner, cell, options, run, progress);
  const Status stopped = runner->Stop();  // the report service writes the pages that are still due
  cell.Stop();
  RETURN_IF_ERROR(inspected);
  RETURN_IF_ERROR(stopped);
  RETURN_IF_ERROR(ShowOutcome(run, runner->station().results, progress.verdicts(), options.parts));
  return progress.not_sorted() == 0
             ? Status()
             : Fail(ErrorCode::kUntrusted, "the line did not sort {} of the parts", progress.not_sorted());
}

}  // namespace

void AddInspectCommand(CLI::App& app, Status& outcome) {
  static InspectOptions options;
  CLI::App* command = app.add_subcommand("inspect", "inspect parts on the virtual station");
  command->add_option("--parts", options.parts, "number of parts")->check(CLI::Range(1, 10'000));
  command->add_option("--station", options.station, "folder of the station to simulate")
      ->check(CLI::ExistingDirectory);
  command->add_option("--cell", options.cell, "imperfections of the cell: a file of the station's folder");
  command->add_option("--out", options.out, "folder for the runs");
  command->add_option("--takt", options.takt_s, "seconds from part to part")
      ->check(FiniteRange(20, 3600))
      ->capture_default_str();
  command->add_option("--scale-divisor", options.scale_divisor, "smaller images; the station must say so too")
      ->check(CLI::IsMember({1, 2, 4, 8}));
  command->add_option("--model-spacing-mm", options.model.spacing_mm, "of the model's surface samples")
      ->check(FiniteRange(0.1, 100))
      ->capture_default_str();
  command
      ->add_option("--model-chord-error-mm", options.model.tessellation.chord_error_mm,
                   "of the model's triangles")
      ->check(FiniteRange(1e-4, 10))
      ->capture_default_str();
  command->add_option("--patience", options.part_patience_s, "seconds a part may take")
      ->check(FiniteRange(1, 1e5));
  command->callback([&outcome] { outcome = Inspect(options); });
}

}  // namespace forgescan
