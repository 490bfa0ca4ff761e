#include "tools/forgescan/station/station_units.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "services/common/output_file.h"
#include "services/recorder/recorder_config.h"
#include "tools/forgescan/station/network.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

// What systemd takes unquoted and without a meaning of its own.
bool IsPlain(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == '/';
  });
}

// Limits by what a service does: compute services hold whole parts, senders hold what may be asked for again.
struct Limits {
  const char* memory;
  const char* cpu_weight;
};

Limits LimitsOf(StationStage stage) {
  switch (stage) {
    case kRecording:
      return {"4G", "100"};
    case kComputing:
      return {"8G", "50"};
    case kSensing:
      return {"2G", "200"};
    case kMoving:
      return {"1G", "400"};  // robot and trigger answer in milliseconds, however busy the rest is
  }
  return {"1G", "100"};
}

// What touches a device besides the bus.
std::string Families(const std::string& service, const Station& station) {
  const bool on_can = service == "robot" || service == "trigger" || service == "cooling";
  const bool socketcan = station.can_url.starts_with("socketcan:");
  return on_can && socketcan ? "AF_UNIX AF_INET AF_NETLINK AF_CAN" : "AF_UNIX AF_INET AF_NETLINK";
}

constexpr const char* kHardening = R"(NoNewPrivileges=yes
ProtectSystem=strict
ProtectHome=read-only
PrivateTmp=yes
PrivateDevices=yes
ProtectClock=yes
ProtectHostname=yes
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
RestrictNamespaces=yes
RestrictSUIDSGID=yes
RestrictRealtime=no
LockPersonality=yes
CapabilityBoundingSet=
AmbientCapabilities=
SystemCallArchitectures=native
SystemCallFilter=@system-service
SystemCallErrorNumber=EPERM
UMask=0027
)";

class Units {
 public:
  Units(const Station& station, const SupervisionPolicy& policy, const UnitOptions& options)
      : station_(station), policy_(policy), options_(options), prefix_("forgescan-" + station.name) {}

  UnitFile Target() const;
  UnitFile Route() const;
  UnitFile Service(const StationService& service) const;

 private:
  std::string UnitOf(const std::string& service) const { return prefix_ + "-" + service + ".service"; }
  // Units of the services before this one in the order of starting; of all, for an empty name.
  std::vector<std::string> Before(const std::string& service) const;
  std::string Supervision(const std::string& service) const;
  // Folders the service writes to; all else is read-only.
  std::string Writable(const std::string& service) const;

  const Station& station_;
  const SupervisionPolicy& policy_;
  const UnitOptions& options_;
  std::string prefix_;
};

std::vector<std::string> Units::Before(const std::string& service) const {
  std::vector<std::string> units;
  for (const StationService& earlier : StationServices(station_)) {
    if (earlier.name == service) {
      break;
    }
    units.push_back(UnitOf(earlier.name));
  }
  return units;
}

UnitFile Units::Target() const {
  const auto all = Before("");
  return {prefix_ + ".target",
          fmt::format("# Written by forgescan station units.\n"
                      "[Unit]\nDescription=forgescan station {}\nWants={} {}\nAfter=network-online.target\n"
                      "Wants=network-online.target\n\n[Install]\nWantedBy=multi-user.target\n",
                      station_.name, prefix_ + "-route.service", fmt::join(all, " "))};
}

// The bus stays on this computer only if its group is routed to loopback, whatever the cables do.
UnitFile Units::Route() const {
  std::string text = fmt::format(
      "# Written by forgescan station units.\n"
      "[Unit]\nDescription=Multicast route of forgescan station {}\nAfter=network.target\nPartOf={}\n\n"
      "[Service]\nType=oneshot\nRemainAfterExit=yes\n",
      station_.name, prefix_ + ".target");
  for (const std::string& group : GroupsOf(station_)) {
    text += fmt::format("ExecStart=/bin/ip route replace {}/32 dev lo\n", group);
  }
  text +=
      "CapabilityBoundingSet=CAP_NET_ADMIN\nProtectSystem=strict\nProtectHome=yes\nPrivateTmp=yes\n"
      "NoNewPrivileges=yes\nRestrictAddressFamilies=AF_UNIX AF_INET AF_NETLINK\n";
  return {prefix_ + "-route.service", text};
}

// systemd's own limits, from the same policy. It has no growing back-off: the pause is the one before the
// second restart, and 1 s at most.
std::string Units::Supervision(const std::string& service) const {
  return fmt::format(
      "Restart=on-failure\nRestartSec={}\nTimeoutStartSec={}\nTimeoutStopSec={}\nWatchdogSec={}\n"
      "WatchdogSignal=SIGKILL\n",
      std::min(policy_.backoff_s, 1.0), std::ceil(policy_.start_patience_s),
      std::ceil(policy_.StopPatienceS(service)), policy_.silence_s);
}

std::string Units::Writable(const std::string& service) const {
  const std::string common = fmt::format("{}/log {}", options_.folder, station_.results);
  return service == "recorder" ? common + " " + options_.recordings : common;
}

UnitFile Units::Service(const StationService& service) const {
  const auto before = Before(service.name);  // started before it, and so stopped after it
  const Limits limits = LimitsOf(service.stage);
  std::string command = options_.programs + "/" + service.program;
  for (const std::string& argument : service.arguments) {
    command += " " + argument;
  }
  const std::string start_limit = fmt::format("StartLimitIntervalSec={}\nStartLimitBurst={}\n",
                                              std::ceil(policy_.restart_window_s), policy_.restarts_max + 1);
  std::string text = fmt::format(
      "# Written by forgescan station units.\n"
      "[Unit]\nDescription=forgescan {} of station {}\nPartOf={}\nRequires={}\nAfter={} {}\n{}\n"
      "[Service]\nType=notify\nNotifyAccess=main\nExecStart={} --station {}\nUser={}\nGroup={}\n{}",
      service.name, station_.name, prefix_ + ".target", prefix_ + "-route.service",
      prefix_ + "-route.service", fmt::join(before, " "), start_limit, command, options_.folder,
      options_.user, options_.user, Supervision(service.name));
  // The last three as tools/setup-host has them for services started by hand.
  text += fmt::format(
      "MemoryMax={}\nCPUWeight={}\nTasksMax=256\nLimitCORE=0\n"
      "LimitNOFILE=4096\nLimitRTPRIO=20\nLimitMEMLOCK=1G\n",
      limits.memory, limits.cpu_weight);
  text += kHardening;
  text += fmt::format("RestrictAddressFamilies={}\nReadWritePaths={}\n\n[Install]\nWantedBy={}\n",
                      Families(service.name, station_), Writable(service.name), prefix_ + ".target");
  return {UnitOf(service.name), text};
}

}  // namespace

Result<std::vector<UnitFile>> MakeUnits(const Station& station, const SupervisionPolicy& policy,
                                        const UnitOptions& options) {
  const std::pair<const char*, std::string> words[] = {
      {"the station's name", station.name},          {"--user", options.user},
      {"the station's folder", options.folder},      {"results", station.results},
      {"the recorder's folder", options.recordings}, {"the programs' folder", options.programs}};
  for (const auto& [what, text] : words) {
    if (!IsPlain(text)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "{} \"{}\" cannot stand in a systemd unit: letters, digits, - _ . / are allowed", what,
                  text);
    }
  }
  if (station.name.find('/') != std::string::npos) {
    return Fail(ErrorCode::kInvalidArgument, "the station's name \"{}\" becomes a file name: no /",
                station.name);
  }
  const Units units(station, policy, options);
  std::vector<UnitFile> files{units.Target(), units.Route()};
  for (const StationService& service : StationServices(station)) {
    files.push_back(units.Service(service));
  }
  return files;
}

Status WriteStationUnits(const UnitOptions& given) {
  UnitOptions options = given;
  options.folder = fs::absolute(given.folder).lexically_normal().string();
  if (options.folder.ends_with('/')) {
    options.folder.pop_back();
  }
  ASSIGN_OR_RETURN(const Station station, Station::Load(options.folder));
  ASSIGN_OR_RETURN(const auto policy, SupervisionPolicy::Load(station.file));
  ASSIGN_OR_RETURN(const auto recorder, RecorderConfig::Load(station.file.Table("recorder")));
  options.recordings = (fs::path(options.folder) / recorder.folder).lexically_normal().string();
  ASSIGN_OR_RETURN(const auto files, MakeUnits(station, policy, options));
  std::error_code problem;
  fs::create_directories(options.out, problem);
  for (const UnitFile& file : files) {
    RETURN_IF_ERROR(WriteOutputFile(fs::path(options.out) / file.name, file.text));
  }
  std::printf(
      "%zu units in %s; as root: cp them to /etc/systemd/system, make the folders\n%s/log\n%s\n%s\n"
      "owned by %s, then systemctl daemon-reload && systemctl enable --now forgescan-%s.target\n",
      files.size(), options.out.c_str(), options.folder.c_str(), station.results.c_str(),
      options.recordings.c_str(), options.user.c_str(), station.name.c_str());
  return {};
}

}  // namespace forgescan
