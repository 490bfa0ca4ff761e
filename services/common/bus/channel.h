// A channel's name with the one type that travels on it: publishing another type does not compile.
#pragma once

namespace forgescan {

// Carried by the resend protocol: complete and in order (StreamHub).
template <typename Message>
struct Channel {
  const char* name;
};

// Sent again and again, newest counts (PublishState, SubscribeState).
template <typename Message>
struct StateChannel {
  const char* name;
};

// Never on the bus: what the recorder adds to its files.
template <typename Message>
struct LogChannel {
  const char* name;
};

}  // namespace forgescan
