#include "services/common/config/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

ConfigFile Parse(std::string_view text) {
  auto file = ConfigFile::Parse(text, "station.toml");
  EXPECT_TRUE(file.ok());
  return *file;
}

TEST(Config, ReadsEveryKind) {
  auto root = Parse("a = 1.5\nb = 3\nc = true\nd = 'x'\ne = ['p', 'q']\nf = [1, 2.5]\n").Root();
  double a = 0, unset = 7;
  int b = 0;
  bool c = false;
  std::string d;
  std::vector<std::string> e;
  std::vector<double> f;
  root.Required("a", a, 0.0, 2.0);
  root.Required("b", b, 0, 9);
  root.Required("c", c);
  root.Required("d", d);
  root.Required("e", e);
  root.Required("f", f, 2, 0.0, 9.0);
  root.Optional("g", unset, 0.0, 9.0);
  ASSERT_TRUE(root.Finish().ok());
  EXPECT_EQ(a, 1.5);
  EXPECT_EQ(b, 3);
  EXPECT_TRUE(c);
  EXPECT_EQ(d, "x");
  EXPECT_EQ(e, (std::vector<std::string>{"p", "q"}));
  EXPECT_EQ(f, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(unset, 7);
}

TEST(Config, NamesTheTablesOfATable) {
  const ConfigFile file = Parse("[own.b]\nx = 1\n[own.a]\n");
  auto own = file.Table("own");
  EXPECT_EQ(own.TableNames(), (std::vector<std::string>{"a", "b"}));
  EXPECT_TRUE(own.Finish().ok()) << "their keys are for their readers";
  auto none = file.Table("none");
  EXPECT_TRUE(none.TableNames().empty());
  auto mixed = Parse("[own]\nc = 1\n").Table("own");
  static_cast<void>(mixed.TableNames());
  EXPECT_THAT(mixed.Finish().error().message, HasSubstr("station.toml: own.c must be a table"));
}

TEST(Config, ATableThatIsAValueIsAnError) {
  const Status status = Parse("a = 1\n").OnlyTables({"a"});
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("station.toml: line 1: a must be a table"));
}

TEST(Config, OutOfRangeNamesFileKeyAndLimits) {
  auto file = Parse("[trigger]\nperiod_us = 5\n");
  auto table = file.Table("trigger");
  int period = 42;
  table.Required("period_us", period, 1000, 100000);
  const Status status = table.Finish();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, AllOf(HasSubstr("station.toml"), HasSubstr("trigger.period_us"),
                                            HasSubstr("is 5"), HasSubstr("1000 to 100000")));
  EXPECT_EQ(period, 42);
}

TEST(Config, MissingKeyNamesWhatIsRequired) {
  auto root = Parse("").Root();
  double value = 0;
  root.Required("gain", value, 0.0, 1.0);
  const Status status = root.Finish();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, AllOf(HasSubstr("gain is missing"), HasSubstr("0 to 1")));
}

TEST(Config, UnknownKeyIsNamedWithItsLine) {
  auto root = Parse("a = 1\ngian = 2\n").Root();
  int a = 0;
  root.Required("a", a, 0, 9);
  const Status status = root.Finish();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message,
              AllOf(HasSubstr("line 2"), HasSubstr("gian"), HasSubstr("known here: a")));
}

TEST(Config, NotANumberAndNaNAreRefused) {
  for (const char* text : {"a = 'x'", "a = nan", "a = inf", "a = [1]"}) {
    auto root = Parse(text).Root();
    double a = 0;
    root.Required("a", a, -1e300, 1e300);
    EXPECT_FALSE(root.Finish().ok()) << text;
  }
}

TEST(Config, NestedTablesAreChecked) {
  auto root = Parse("[[view]]\nindex = 0\n[[view]]\nindex = 1\ntypo = 3\n").Root();
  auto views = root.Tables("view");
  ASSERT_EQ(views.size(), 2u);
  for (auto& view : views) {
    int index = -1;
    view.Required("index", index, 0, 9);
  }
  const Status status = root.Finish();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("view[1].typo"));
}

TEST(Config, SyntaxErrorHasLineAndColumn) {
  const auto file = ConfigFile::Parse("a = \n", "broken.toml");
  ASSERT_FALSE(file.ok());
  EXPECT_THAT(file.error().message, AllOf(HasSubstr("broken.toml"), HasSubstr("line 1")));
}

TEST(Config, MissingFileIsAnError) { EXPECT_FALSE(ConfigFile::Load("/nonexistent/x.toml").ok()); }

TEST(Config, HashTellsTwoFilesApart) { EXPECT_NE(Parse("a = 1").hash(), Parse("a = 2").hash()); }

}  // namespace
}  // namespace forgescan
