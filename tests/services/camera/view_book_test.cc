#include "services/camera/view_book.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr int kPulses = 3;

fsmsg::exposure_t Pulse(int view, int attempt = 0) {
  fsmsg::exposure_t exposure{};
  exposure.part = 7;
  exposure.view = view;
  exposure.attempt = attempt;
  return exposure;
}

fsmsg::view_captured_t Captured(int view, int attempt = 0, bool captured = true) {
  fsmsg::view_captured_t message{};
  message.utime = 4242;
  message.part = 7;
  message.view = view;
  message.attempt = attempt;
  message.status = captured ? fsmsg::view_captured_t::STATUS_CAPTURED : fsmsg::view_captured_t::STATUS_VOID;
  message.pulses_expected = kPulses;
  return message;
}

class ViewBookTest : public ::testing::Test {
 protected:
  void Send(int view, int frames, int attempt = 0) {
    for (int i = 0; i < frames; ++i) {
      book_.OnSent(Pulse(view, attempt));
    }
  }
  ViewBook book_{fsmsg::exposure_t::CAMERA_RIGHT};
};

TEST_F(ViewBookTest, Starts) { EXPECT_TRUE(book_.TakeClosed().empty()); }

TEST_F(ViewBookTest, AWholeViewIsClosedOnce) {
  Send(4, kPulses);
  EXPECT_TRUE(book_.TakeClosed().empty());  // how many there must be is not known yet
  book_.OnCaptured(Captured(4));
  const auto closed = book_.TakeClosed();
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].utime, 4242);
  EXPECT_EQ(closed[0].part, 7);
  EXPECT_EQ(closed[0].view, 4);
  EXPECT_EQ(closed[0].camera, fsmsg::exposure_t::CAMERA_RIGHT);
  EXPECT_EQ(closed[0].frames_expected, kPulses);
  EXPECT_EQ(closed[0].frames_sent, kPulses);
  EXPECT_EQ(closed[0].frames_missing, 0);
  EXPECT_TRUE(closed[0].reason.empty());
  EXPECT_TRUE(book_.TakeClosed().empty());
}

TEST_F(ViewBookTest, TheEndMayComeBeforeTheFrames) {
  book_.OnCaptured(Captured(0));
  Send(0, kPulses - 1);
  EXPECT_TRUE(book_.TakeClosed().empty());
  Send(0, 1);
  EXPECT_EQ(book_.TakeClosed().size(), 1u);
}

TEST_F(ViewBookTest, TheFirstMissingFrameGivesTheReason) {
  Send(0, 1);
  book_.OnMissing(Pulse(0), "first");
  book_.OnMissing(Pulse(0), "second");
  book_.OnLate(Pulse(0));
  book_.OnDuplicate(Pulse(0));
  book_.OnCaptured(Captured(0));
  const auto closed = book_.TakeClosed();
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].frames_sent, 1);
  EXPECT_EQ(closed[0].frames_missing, 2);
  EXPECT_EQ(closed[0].frames_late, 1);
  EXPECT_EQ(closed[0].frames_duplicate, 1);
  EXPECT_EQ(closed[0].reason, "first");
}

TEST_F(ViewBookTest, AttemptsOfAViewAreCountedApart) {
  Send(0, 1, 0);
  Send(0, kPulses, 1);
  book_.OnCaptured(Captured(0, 0, false));
  book_.OnCaptured(Captured(0, 1));
  const auto closed = book_.TakeClosed();
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].attempt, 1);
  EXPECT_EQ(closed[0].frames_sent, kPulses);
}

TEST_F(ViewBookTest, ExpiryCountsWhatIsOpenAsMissing) {
  Send(0, 1);
  book_.OnCaptured(Captured(0));
  book_.Expire({7, 0, 0});
  const auto closed = book_.TakeClosed();
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0].frames_missing, kPulses - 1);
  EXPECT_THAT(closed[0].reason, HasSubstr("2 pulses never came"));
}

TEST_F(ViewBookTest, NothingExpiresThatIsUnknownOrNotCaptured) {
  Send(1, 1);
  book_.Expire({7, 1, 0});
  book_.Expire({8, 0, 0});
  EXPECT_TRUE(book_.TakeClosed().empty());
  Send(1, kPulses - 1);
  book_.OnCaptured(Captured(1));
  EXPECT_EQ(book_.TakeClosed().at(0).frames_missing, 0);  // and it still works
}

}  // namespace
}  // namespace forgescan
