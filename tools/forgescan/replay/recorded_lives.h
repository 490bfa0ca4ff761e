// From when to when each process of a service lived, by its own words in a record: SERVICE_STATE and the
// headers of its streams name the session, which is the process.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/forgescan/replay/recorded_session.h"
#include "tools/forgescan/replay/replayable_services.h"

namespace forgescan {

struct RecordedLife {
  enum class End {
    kRunsOn,   // with the record
    kStopped,  // on request: what it says at the end is in the record
    kKilled,   // without a last word, and another followed
  };

  std::int64_t session = 0;
  // The event at which it listens: its first word past STARTING, as it loads its files until then. Nothing =
  // from the record's beginning.
  std::optional<std::size_t> begin;
  bool listened = true;       // false: it ended while it was starting
  std::size_t last_word = 0;  // the event; that it stops, for kStopped
  // The last event that it may have heard. For kStopped its last word. One that was killed died between its
  // last word and the next word that was due, and before the session that follows.
  std::size_t end = 0;
  End how = End::kRunsOn;
  // The newest event (us since 1970 UTC) of which it spoke, by channel. It computed until it was killed; what
  // it would have said of a later event, it did not come to say.
  std::map<std::string, std::int64_t, std::less<>> last_utime;
};

// In order of time, for each service; at least one, from the record's beginning. A session of one word only
// is no life: one wrong bit makes such a session. Errors: kIo.
Result<std::vector<std::vector<RecordedLife>>> LivesOf(const RecordedSession& session,
                                                       const std::vector<ReplayableService>& services);

}  // namespace forgescan
