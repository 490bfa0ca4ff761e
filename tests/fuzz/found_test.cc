// What damaged files have found: one case each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "drivers/can/dbc.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/config/config.h"
#include "services/common/imaging/stereo_calibration.h"
#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "services/common/model/stl_file.h"
#include "services/reconstruction/pattern_set.h"
#include "services/recorder/recording_name.h"
#include "services/robot/part_memory.h"
#include "tests/fuzz/readers.h"
#include "tools/forgescan/image_header.h"

namespace forgescan::fuzz {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// LCM's generated code made room for 2^31 elements before it looked for them: some 300 GB.
TEST(Found, AMessageThatClaimsMoreThanItHasIsRefusedAtOnce) {
  fsmsg::verdict_t verdict{};
  Bytes bytes = Encode(verdict);
  for (const std::uint32_t count : {0x7fffffffU, 0x80000000U, 1U}) {
    for (std::size_t i = 0; i < 4; ++i) {  // the count is the last field before the array
      bytes[bytes.size() - 4 + i] = static_cast<std::uint8_t>(count >> (24 - 8 * i));
    }
    const auto decoded = Decode<fsmsg::verdict_t>(bytes);
    ASSERT_FALSE(decoded.ok());
    EXPECT_THAT(decoded.error().message, Not(HasSubstr("alloc")));
  }
  EXPECT_TRUE(Decode<fsmsg::verdict_t>(Encode(verdict)).ok());
}

// It copied 2^31 bytes from behind the message: the length less one, below the least number.
TEST(Found, ATextOfNegativeLengthIsRefused) {
  for (const std::uint32_t length : {0x80000000U, 0xffffffffU, 0U}) {
    Bytes bytes = Encode(fsmsg::service_state_t{});
    for (std::size_t i = 0; i < 4; ++i) {  // of the name, behind fingerprint, utime and session
      bytes[24 + i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
    }
    EXPECT_FALSE(Decode<fsmsg::service_state_t>(bytes).ok()) << length;
  }
  EXPECT_TRUE(Decode<fsmsg::service_state_t>(Encode(fsmsg::service_state_t{})).ok());
}

// Parsers that call themselves, or std::regex that does, used up the stack.
TEST(Found, DeepNestingAndLongLinesAreRefused) {
  const std::string head = "%YAML:1.0\n---\nKl: ";
  for (const std::string& nest : {std::string(200'000, '['), std::string(200'000, '{')}) {
    EXPECT_FALSE(LoadStereoCalibration(ScratchFile("stereo.yaml", head + nest)).ok());
  }
  std::string dashes, tags = "<?xml version=\"1.0\"?>\n<opencv_storage>\n";
  for (int i = 0; i < 100'000; ++i) dashes += "- ";
  for (int i = 0; i < 100'000; ++i) tags += "<a>\n";
  EXPECT_FALSE(LoadStereoCalibration(ScratchFile("stereo.yaml", head + dashes)).ok());
  EXPECT_FALSE(LoadStereoCalibration(ScratchFile("stereo.yaml", tags)).ok());
  EXPECT_FALSE(ParseDbc("CM_ BO_ 1 \"" + std::string(100'000, 'a') + "\";\n").ok());
}

// Counting on from the greatest number is undefined.
TEST(Found, AStreamWithImpossibleSequencesIsCountedAsDamaged) {
  SimNetwork network;
  SimBus& ours = network.AddNode();
  SimBus& theirs = network.AddNode();
  StreamHub hub(ours, "ours");
  int heard = 0;
  hub.Subscribe<fsmsg::verdict_t>(kVerdict, [&heard](const auto&) { ++heard; });
  using Limits = std::numeric_limits<std::int64_t>;
  for (const std::int64_t sequence : {Limits::min(), std::int64_t{0}, Limits::max()}) {
    Bytes bytes = Encode(fsmsg::verdict_t{});
    ASSERT_TRUE(StampStreamHeader(bytes, {1, sequence}).ok());
    ASSERT_TRUE(theirs.Publish(kVerdict.name, bytes).ok());
  }
  network.RunFor(1'000'000);
  EXPECT_EQ(heard, 0);
  EXPECT_EQ(hub.counters().damaged, 3);
  StreamHub sender(theirs, "theirs");
  ASSERT_TRUE(sender.Publish(kVerdict, fsmsg::verdict_t{}).ok());
  network.RunFor(1'000'000);
  EXPECT_EQ(heard, 1);
}

// OpenCV made room for all of them first.
TEST(Found, ACalibrationMatrixWithoutItsNumbersIsRefused) {
  const std::string text =
      "%YAML:1.0\n---\nKl: !!opencv-matrix\n   rows: 60000\n   cols: 60000\n   dt: d\n   data: [ 1., 2. ]\n";
  const auto calibration = LoadStereoCalibration(ScratchFile("stereo.yaml", text));
  ASSERT_FALSE(calibration.ok());
  EXPECT_THAT(calibration.error().message, HasSubstr("rows times cols"));
}

// Retention takes its files by their names: other spellings of a number are not the recorder's.
TEST(Found, RecordingsHaveOneNameOnly) {
  EXPECT_TRUE(ParseRecordingName("20261122T141508.123456Z_part000043_OK.lcmlog").has_value());
  EXPECT_FALSE(ParseRecordingName("20261122T141508.123456Z_part00000043_OK.lcmlog").has_value());
}

// Codecs made room for the pixels that a header claims: 3 GB for a file of 30 bytes.
TEST(Found, AnImageSaysHowLargeItIsBeforeRoomIsMade) {
  EXPECT_EQ(ClaimedPixels("P5\n# by hand\n60000 50000\n255\n"), 3'000'000'000U);
  EXPECT_EQ(ClaimedPixels("P5 640 480 255 "), 307'200U);
  const std::string png = std::string("\x89PNG\r\n\x1A\n\0\0\0\rIHDR", 16);
  EXPECT_EQ(ClaimedPixels(png + std::string("\0\1\0\0\0\0\0\2", 8)), 131'072U);
  EXPECT_EQ(ClaimedPixels(png), std::nullopt);
  const std::string entries("\2\0\0\1\4\0\1\0\0\0\0\0\1\0\1\1\3\0\1\0\0\0\7\0\0\0", 26);
  EXPECT_EQ(ClaimedPixels(std::string("II*\0\10\0\0\0", 8) + entries), 65'536U * 7);
  EXPECT_EQ(ClaimedPixels("a text"), std::nullopt);
}

// OpenCV's YAML parser ran for ever.
TEST(Found, ACalibrationOfSeveralDocumentsIsRefused) {
  const std::string text =
      "%YAML:1.r; %YA!!opencv-matrix\n  \n   cols: 3\n Y0\n--.0\n----\nK1.0\n---\nK,: "
      "en\n\xB5lc%Y:0.0\n---\n\xB5height: 120\n";
  EXPECT_FALSE(LoadStereoCalibration(ScratchFile("stereo.yaml", text)).ok());
}

// The same, with the rest of the document on its line.
TEST(Found, ACalibrationThatBeginsOnTheLineOfItsMarkIsRefused) {
  const auto calibration =
      LoadStereoCalibration(ScratchFile("stereo.yaml", "%YAML:1.0\n---stereo.yaml%YAML:1.0\n-cv-ma--\nKl: "));
  ASSERT_FALSE(calibration.ok());
  EXPECT_THAT(calibration.error().message, HasSubstr("one line ---"));
}

// toml++ reached what it holds unreachable.
TEST(Found, ALetterBeyondAsciiStandsOnlyInTextsAndComments) {
  const auto complaint = [](const std::string& text) {
    const auto file = ConfigFile::Parse(text, "station.toml");
    return file.ok() ? std::string() : file.error().message;
  };
  EXPECT_THAT(complaint("a = 1\nb = ä\n"), HasSubstr("station.toml: line 2: a character beyond ASCII"));
  for (const char* text :
       {"ä = 1", "a = 1 、", "\xC9\x85", R"(a = """"""ä)", R"(a = "\ä")", "a = \"\"\"\\\n  ä\"\"\"",
        "a = 'b' ä", "a = '''b''''' ä", "a = 6b'ä'", "a = 6b='ä'", "a = 6['ä'", "a = 6=['ä'", "a = 6.'ä'",
        "a = [\n6='ä'\n]", "a = [1, 6.'ä']", "a = [6]['ä'", "a = \"\"\"x\\\n\"\"\"\nb = ä"}) {
    EXPECT_THAT(complaint(text), HasSubstr("beyond ASCII")) << text;
  }
  for (const char* text :
       {"\uFEFFa = 1", R"(a = "ä\"ä" # ä)", R"(a = '\' # ä)", "b='ä'", "b = [['ä','ä'],['ä']]",
        "b = {c='ä',d='ä'}", "a = \"\"\"\n\\\n \\nä\"\"\"\"\"", "a = '''ä'\n''ä'''",
        "a = \"\"\"x\\\n\"\"\"\nb = \"\"\"ä\"\"\"", "a = \"\"\"\\\n\\\"ä\"\"\"", R"(a."ä" = 1)",
        R"([servers."ä"])", R"("a b"="ä")",
        "a = [1979-05-27 07:32:00, 'ä',\n6,'ä', {b.'ä'=6,'c d'='ä'}]\n[[x.'ä']]\n'ä'.'ä'={}"}) {
    EXPECT_EQ(complaint(text), "") << text;
  }
}

// toml++ cast it to a whole number, which is undefined.
TEST(Found, AHugeNumberOfPixelsIsRefused) {
  const auto pattern = ParsePatternSet("projector_width_px = 12e80\nbackground = 'own'\n", "pattern.toml");
  ASSERT_FALSE(pattern.ok());
  EXPECT_THAT(pattern.error().message, HasSubstr("projector_width_px"));
}

// Cells of such a mesh cannot be numbered.
TEST(Found, AnStlBeyondAHundredMetresIsRefused) {
  const auto mesh = DecodeStl(
      "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1e30 0 0\nvertex 1e30 1e-25 "
      "0\nendloop\nendfacet\nendsolid\n");
  ASSERT_FALSE(mesh.ok());
  EXPECT_THAT(mesh.error().message, HasSubstr("allowed up to 100000 mm"));
}

TEST(Found, AModelWithoutAreaNamesTheFile) {
  const std::string path = ScratchFile(
      "flat.stl",
      "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 2 0 0\nendloop\nendfacet\nendsolid\n");
  const auto model = LoadModel(path, {});
  ASSERT_FALSE(model.ok());
  EXPECT_THAT(model.error().message, HasSubstr("flat.stl"));
}

TEST(Found, AFaceWithAnInfiniteRadiusIsNoModel) {
  const auto model =
      ModelFromMesh({.vertices = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, .triangles = {{0, 1, 2}}}, 1);
  ASSERT_TRUE(model.ok());
  ModelBundle bundle = *model;
  ASSERT_TRUE(Check(bundle).ok());
  bundle.faces[0].radius_mm = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(Check(bundle).ok());
  bundle.faces[0].radius_mm = 0;
  bundle.spacing_mm = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(Check(bundle).ok());
}

// A sentence quotes a file; it must not speak to the terminal or fill it.
TEST(Found, AnErrorQuotesNoControlCharactersAndNoWholeFile) {
  PartMemory memory(ScratchFile("robot_parts", "1 \x1B[2J" + std::string(100'000, 'a')));
  const Status recalled = memory.Recall();
  ASSERT_FALSE(recalled.ok());
  EXPECT_THAT(recalled.error().message, Not(HasSubstr("\x1B")));
  EXPECT_LT(recalled.error().message.size(), 400U);
  EXPECT_EQ(Fail(ErrorCode::kFormat, "{}", std::string(10'000, 'a')).message.size(), 4004U);
}

}  // namespace
}  // namespace forgescan::fuzz
