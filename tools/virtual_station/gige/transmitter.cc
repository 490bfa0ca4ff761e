#include "tools/virtual_station/gige/transmitter.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan::gige {
namespace {

constexpr std::size_t kBatch_packets = 32;
constexpr std::int64_t kBatch_ns = 500'000;  // packets due within this time go out together
// A thread that the system woke late sends what is due at once and is back on the camera's schedule. Beyond
// this, a burst would overrun a receiver that a real camera would not: then the frame simply starts late.
constexpr std::int64_t kCatchUp_ns = 20'000'000;
constexpr std::size_t kMemory_frames = 4;
constexpr std::size_t kHistory_frames = 8;

iovec Piece(std::span<const std::uint8_t> bytes) {
  return {const_cast<std::uint8_t*>(bytes.data()), bytes.size()};  // sendmmsg does not write
}

}  // namespace

// Packets on their way into one system call; owns their heads, keeps their frames alive.
struct Transmitter::Batch {
  struct Entry {
    GvspPacket packet;
    sockaddr_in target;
    std::array<iovec, 3> pieces;
  };
  std::array<Entry, kBatch_packets> entries;
  std::array<mmsghdr, kBatch_packets> messages{};
  std::size_t size = 0;
};

Transmitter::Transmitter(int fd, TransmitterOptions options)
    : fd_(fd), options_(std::move(options)), random_(options_.seed), thread_([this] { Run(); }) {}

Transmitter::~Transmitter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

bool Transmitter::Submit(std::shared_ptr<const GvspFrame> frame) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMemory_frames) {
      return false;
    }
    waiting_.push_back(std::move(frame));
  }
  wake_.notify_one();
  return true;
}

void Transmitter::RequestResend(const ResendRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    resends_.push_back(request);
  }
  wake_.notify_one();
}

void Transmitter::Forget() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  history_.clear();
  resends_.clear();
  active_.reset();
}

void Transmitter::SetFaults(double packet_loss_chance, bool resend_unavailable) {
  const std::lock_guard lock(mutex_);
  packet_loss_chance_ = packet_loss_chance;
  resend_unavailable_ = resend_unavailable;
}

TransmitterCounters Transmitter::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

// The lock is held but while waiting: sending a batch to a local socket takes some 10 us, and Submit can wait
// that long.
void Transmitter::Run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    if (resends_.empty() && !active_ && !StartFrame()) {
      wake_.wait(lock);
    } else if (port_free_ns_ > MonoNowNs()) {
      wake_.wait_until(lock, MonoTimePoint(port_free_ns_));
    } else if (!resends_.empty()) {
      ServeResend();
    } else {
      SendSome();
    }
  }
}

bool Transmitter::StartFrame() {
  if (waiting_.empty()) {
    return false;
  }
  active_ = std::move(waiting_.front());
  waiting_.pop_front();
  next_packet_ = 0;
  const std::int64_t now_ns = MonoNowNs();
  const bool late = active_->ready_ns < now_ns - kCatchUp_ns;
  counters_.frames_late += late ? 1U : 0U;
  port_free_ns_ = std::max(port_free_ns_, late ? now_ns : active_->ready_ns);
  history_.push_back(active_);
  if (history_.size() > kHistory_frames) {
    history_.pop_front();
  }
  return true;
}

void Transmitter::SendSome() {
  Batch batch;
  const std::int64_t until_ns = MonoNowNs() + kBatch_ns;
  const std::uint32_t packets = active_->packets();
  for (std::size_t i = 0; i < kBatch_packets && next_packet_ < packets && port_free_ns_ <= until_ns; ++i) {
    Add(batch, *active_, MakePacket(*active_, next_packet_, PacketStatus::kSuccess));
    ++next_packet_;
  }
  Send(batch);
  if (next_packet_ == packets) {
    ++counters_.frames;
    active_.reset();
  }
}

// Resends go before what waits, at the pace of the wire like everything else.
void Transmitter::ServeResend() {
  ResendRequest& request = resends_.front();
  const auto found = std::find_if(history_.begin(), history_.end(),
                                  [&](const auto& frame) { return frame->block_id == request.block_id; });
  if (history_.empty()) {
    resends_.pop_front();  // nothing was sent since the start: there is not even a host to answer
    return;
  }
  const bool available = found != history_.end() && !resend_unavailable_;
  const GvspFrame& frame = available ? **found : *history_.back();
  const std::uint32_t end =
      std::min(request.last_packet + 1, available ? frame.packets() : request.last_packet + 1);
  Batch batch;
  port_free_ns_ = std::max(port_free_ns_, MonoNowNs());
  const std::int64_t until_ns = port_free_ns_ + kBatch_ns;
  for (std::size_t i = 0; i < kBatch_packets && request.first_packet < end && port_free_ns_ <= until_ns;
       ++i) {
    const std::uint32_t packet = request.first_packet++;
    Add(batch, frame,
        available ? MakePacket(frame, packet, PacketStatus::kResent)
                  : MakeUnavailable(request.block_id, packet));
    ++(available ? counters_.packets_resent : counters_.resends_unavailable);
  }
  Send(batch);
  if (request.first_packet >= end) {
    resends_.pop_front();
  }
}

void Transmitter::Add(Batch& batch, const GvspFrame& frame, const GvspPacket& packet) {
  const std::int64_t departs_ns = port_free_ns_;
  port_free_ns_ += WireTimeNs(packet.wire_bytes(), options_.rate_mbit_s) + frame.packet_delay_ns;
  const double draw = static_cast<double>(random_() >> 11) * 0x1p-53;
  if (draw < packet_loss_chance_) {
    ++counters_.packets_lost;
    return;
  }
  if (options_.link && !options_.link->Admit(departs_ns, packet.wire_bytes())) {
    ++counters_.packets_refused;
    return;
  }
  Batch::Entry& entry = batch.entries[batch.size];
  entry.packet = packet;
  entry.target = frame.target;
  entry.pieces = {Piece(std::span(entry.packet.head).first(packet.head_bytes)), Piece(packet.image_part),
                  Piece(packet.chunk_part)};
  msghdr& message = batch.messages[batch.size].msg_hdr;
  message.msg_name = &entry.target;
  message.msg_namelen = sizeof entry.target;
  message.msg_iov = entry.pieces.data();
  message.msg_iovlen = entry.pieces.size();
  ++batch.size;
}

void Transmitter::Send(Batch& batch) {
  std::size_t done = 0;
  while (done < batch.size) {
    const int sent = ::sendmmsg(fd_, &batch.messages[done], static_cast<unsigned>(batch.size - done), 0);
    if (sent > 0) {
      counters_.packets += static_cast<std::uint64_t>(sent);
      done += static_cast<std::size_t>(sent);
    } else {
      ++counters_.packets_failed;  // the first of the rest was refused; the others get their chance
      ++done;
    }
  }
}

}  // namespace forgescan::gige
