#include "tools/forgescan/replay/chained_results.h"

#include "services/common/bus/stream_header.h"

namespace forgescan {

Status ChainedResults::Add(const std::string& channel, ByteView result) {
  ASSIGN_OR_RETURN(const std::int64_t utime, StreamUtime(result));
  moments_[{channel, utime}].made.emplace_back(result.begin(), result.end());
  MoveWhatIsDue(channel, utime);
  return {};
}

void ChainedResults::Pass(const std::string& channel, std::int64_t utime) {
  ++moments_[{channel, utime}].passed;
  MoveWhatIsDue(channel, utime);
}

std::optional<std::pair<std::string, Bytes>> ChainedResults::Take() {
  if (due_.empty()) {
    return std::nullopt;
  }
  auto result = std::move(due_.front());
  due_.pop_front();
  return result;
}

void ChainedResults::MoveWhatIsDue(const std::string& channel, std::int64_t utime) {
  Moment& moment = moments_[{channel, utime}];
  const bool all = moment.passed >= recorded_.RecordedCount(channel, utime);
  while (!moment.made.empty() && (all || moment.taken < moment.passed)) {
    due_.emplace_back(channel, std::move(moment.made.front()));
    moment.made.pop_front();
    ++moment.taken;
  }
}

}  // namespace forgescan
