// The book stays small and a view is closed once, whatever comes afterwards.
#include <gtest/gtest.h>

#include "services/camera/view_book.h"

namespace forgescan {
namespace {

constexpr std::int8_t kLeft = fsmsg::exposure_t::CAMERA_LEFT;

fsmsg::exposure_t Exposure(int part, std::int64_t utime) {
  fsmsg::exposure_t exposure{};
  exposure.utime = utime;
  exposure.part = part;
  exposure.camera = kLeft;
  return exposure;
}

fsmsg::view_captured_t Captured(int part, std::int64_t utime, bool captured = true) {
  fsmsg::view_captured_t message{};
  message.utime = utime;
  message.part = part;
  message.status = captured ? fsmsg::view_captured_t::STATUS_CAPTURED : fsmsg::view_captured_t::STATUS_VOID;
  message.pulses_expected = 1;
  return message;
}

TEST(ViewBookBounds, LateAndDoubleImagesOfAClosedViewLeaveNothing) {
  ViewBook book(kLeft);
  book.OnSent(Exposure(1, 10));
  book.OnCaptured(Captured(1, 20));
  EXPECT_EQ(book.TakeClosed().size(), 1U);
  book.OnDuplicate(Exposure(1, 10));
  book.OnLate(Exposure(1, 10));
  book.OnMissing(Exposure(1, 10), "late word");
  EXPECT_EQ(book.open_views(), 0U);
  EXPECT_TRUE(book.TakeClosed().empty());
}

TEST(ViewBookBounds, ImagesOfAVoidCaptureLeaveNothing) {
  ViewBook book(kLeft);
  book.OnCaptured(Captured(1, 20, false));
  book.OnSent(Exposure(1, 10));
  EXPECT_EQ(book.open_views(), 0U);
}

TEST(ViewBookBounds, APartNumberThatComesAgainIsANewView) {
  ViewBook book(kLeft);
  for (const std::int64_t start_utime : {0, 1000}) {
    book.OnSent(Exposure(1, start_utime + 10));
    book.OnCaptured(Captured(1, start_utime + 20));
    const auto closed = book.TakeClosed();
    ASSERT_EQ(closed.size(), 1U);
    EXPECT_EQ(closed[0].frames_sent, 1);
  }
}

TEST(ViewBookBounds, ViewsWithoutAnEndAreForgottenByAge) {
  ViewBook book(kLeft);
  for (int part = 1000; part > 0; --part) {  // the newest has the smallest number
    book.OnSent(Exposure(part, 2000 - part));
  }
  EXPECT_LE(book.open_views(), 16U);
  book.OnCaptured(Captured(1, 3000));
  EXPECT_EQ(book.TakeClosed().size(), 1U);
}

}  // namespace
}  // namespace forgescan
