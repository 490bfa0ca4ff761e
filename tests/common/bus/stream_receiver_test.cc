// The receiving half alone: what it believes of a sender, and what it gives up.
#include "services/common/bus/stream_receiver.h"

#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {
namespace {

using Hole = std::pair<std::int64_t, std::int64_t>;

class StreamReceiverTest : public ::testing::Test {
 protected:
  StreamReceiverTest() {
    receiver_.SetHandler([this](ByteView bytes) { got_.push_back(CheckStreamHeader(bytes)->sequence); });
    receiver_.SetLostHandler(
        [this](std::int64_t first, std::int64_t last) { lost_.emplace_back(first, last); });
  }
  Bytes Message(std::int64_t sequence, std::size_t bytes = 10) const {
    fsmsg::frame_t frame{};
    frame.data.assign(bytes, 1);
    frame.size = static_cast<std::int32_t>(bytes);
    Bytes message = Encode(frame);
    EXPECT_TRUE(StampStreamHeader(message, {session_, sequence}).ok());
    return message;
  }
  void SendPiece(const Bytes& message, std::int64_t sequence, int index) {
    constexpr std::size_t kPieceBytes = 1000;
    const std::size_t begin = static_cast<std::size_t>(index) * kPieceBytes;
    fsmsg::resend_piece_t piece{};
    piece.session = session_;
    piece.sequence = sequence;
    piece.message_bytes = static_cast<std::int32_t>(message.size());
    piece.piece_bytes = kPieceBytes;
    piece.piece = index;
    const auto at = message.begin() + static_cast<std::ptrdiff_t>(begin);
    piece.data.assign(at, at + static_cast<std::ptrdiff_t>(std::min(kPieceBytes, message.size() - begin)));
    piece.size = static_cast<std::int32_t>(piece.data.size());
    receiver_.OnPiece(piece);
  }
  void RunFor(std::int64_t seconds) {
    for (std::int64_t i = 0; i < 100 * seconds; ++i) {
      network_.RunFor(10'000);
      receiver_.OnTimer();
    }
  }

  SimNetwork network_;
  Bus& bus_ = network_.AddNode();
  StreamCounters counters_;
  StreamReceiver receiver_{bus_, kFrameLeft.name, StreamOptions{}, counters_};
  const std::int64_t session_ = bus_.NowUs() + 1;
  std::vector<std::int64_t> got_;
  std::vector<Hole> lost_;
};

TEST_F(StreamReceiverTest, StartsAndDelivers) {
  receiver_.OnMessage(Message(1));
  EXPECT_EQ(got_, (std::vector<std::int64_t>{1}));
}

TEST_F(StreamReceiverTest, AStatusThatContradictsItselfIsDamaged) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  receiver_.OnMessage(Message(1));
  const Hole kNonsense[] = {{1'000'000'000, 1}, {3, 1}, {0, 1}, {1, -1}, {kMost, kMost}};
  for (const auto& [first, last] : kNonsense) {
    receiver_.OnStatus(session_, first, last);
  }
  EXPECT_EQ(counters_.damaged, 5);
  EXPECT_TRUE(lost_.empty());
  receiver_.OnMessage(Message(2));
  EXPECT_EQ(got_, (std::vector<std::int64_t>{1, 2}));
}

TEST_F(StreamReceiverTest, ALongHoleIsGivenUpInOneStep) {
  constexpr std::int64_t kFirst = 1'000'000'000'000;  // one by one it would take hours
  receiver_.OnMessage(Message(1));
  receiver_.OnMessage(Message(3));
  receiver_.OnStatus(session_, kFirst, kFirst);
  receiver_.OnMessage(Message(kFirst));
  EXPECT_EQ(got_, (std::vector<std::int64_t>{1, 3, kFirst}));
  EXPECT_EQ(lost_, (std::vector<Hole>{{2, 2}, {4, kFirst - 1}}));
  EXPECT_EQ(counters_.missing, kFirst - 3);
}

TEST_F(StreamReceiverTest, AMessageWhosePiecesStillComeIsNotGivenUpWithALaterOne) {
  constexpr int kPieces = 20;
  const Bytes message = Message(1, 1000 * kPieces - 500);
  ASSERT_EQ((message.size() + 999) / 1000, std::size_t{kPieces});
  receiver_.OnStatus(session_, 1, 2);
  for (int index = 0; index < kPieces; ++index) {  // 1 s each: twice the time to give up
    EXPECT_TRUE(lost_.empty()) << "after " << index << " pieces";
    RunFor(1);
    receiver_.OnStatus(session_, 1, 2);
    SendPiece(message, 1, index);
  }
  EXPECT_EQ(got_, (std::vector<std::int64_t>{1}));
  RunFor(1);
  EXPECT_EQ(lost_, (std::vector<Hole>{{2, 2}}));
}

}  // namespace
}  // namespace forgescan
