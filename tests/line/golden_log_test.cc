// The session of logs/sample computed again by each service that can be: byte for byte as recorded, and as
// the simulated part really was (truth.json beside it, which no service has seen).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/codec.h"
#include "services/common/geometry/triangle_index.h"
#include "services/common/model/bundle_file.h"
#include "services/fusion/view_matrices.h"
#include "tools/forgescan/replay/message_text.h"
#include "tools/forgescan/replay/replay_run.h"
#include "tools/forgescan/replay/scratch_folder.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::IsEmpty;

const fs::path kSample = FORGESCAN_SOURCE_DIR "/logs/sample";
constexpr std::uintmax_t kMaxBytes = 10'000'000;
constexpr std::size_t kFieldsShown = 12;
constexpr int kFramesOfAView = 16;  // 8 patterns, 2 cameras

// Half of a cloud's points lie nearer to the true part than this. Points of images of 304 x 256 px scatter by
// 0.05 mm (rms of the registration); a view lies where 8 markers of 0.02 mm say, and the part's sizes are up
// to 0.1 mm off the model's.
constexpr double kMedianDistanceMm = 0.1;
// Of the far ends of the part: as above, over all points of all views.
constexpr double kPoseMm = 0.1;
// A fifth of the narrowest tolerance, as in real_line_test.
constexpr double kSizeMm = 0.1;
// Temperature is known to 2 K, the steel's expansion to 2 %: 0.05 mm at the ends of the part.
constexpr double kScale = 5e-5;

Json ReadTruth() {
  std::ifstream stream(kSample / "truth.json");
  Json truth = Json::parse(stream, nullptr, false);
  EXPECT_TRUE(truth.is_object()) << "logs/sample/truth.json is not there or no JSON";
  return truth;
}

Eigen::Isometry3d Pose(const auto& numbers) {
  Eigen::Isometry3d pose;
  for (int i = 0; i < 16; ++i) {
    pose.matrix()(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
  }
  return pose;
}

// Every result of the services by channel, in order.
using Results = std::map<std::string, std::vector<Bytes>>;

template <typename Message>
std::vector<Message> As(const Results& results, const char* channel) {
  std::vector<Message> messages;
  const auto found = results.find(channel);
  for (const Bytes& bytes : found == results.end() ? std::vector<Bytes>{} : found->second) {
    const auto message = Decode<Message>(bytes);
    EXPECT_TRUE(message.ok()) << channel;
    messages.push_back(*message);
  }
  return messages;
}

std::vector<std::pair<int, PointCloud>> Clouds(const Results& results, const char* channel) {
  CloudAssembler assembler;
  std::vector<std::pair<int, PointCloud>> clouds;  // view, points
  for (const auto& slice : As<fsmsg::cloud_slice_t>(results, channel)) {
    auto cloud = assembler.Add(slice);
    EXPECT_TRUE(cloud.ok()) << channel;
    if (cloud.ok() && cloud->has_value()) {
      clouds.emplace_back(slice.view, std::move(**cloud));
    }
  }
  return clouds;
}

// Of a cloud that is one slice.
std::optional<PointCloud> WholeCloud(const Bytes& message) {
  const auto slice = Decode<fsmsg::cloud_slice_t>(message);
  if (!slice.ok()) {
    return {};
  }
  auto cloud = CloudAssembler().Add(*slice);
  return cloud.ok() ? std::move(*cloud) : std::nullopt;
}

// The largest changes of a cloud's points; empty for other messages, and where the number of points changed.
std::string CloudDifference(const Bytes& recorded, const Bytes& now) {
  const auto before = WholeCloud(recorded), after = WholeCloud(now);
  if (!before.has_value() || !after.has_value() || before->size() != after->size()) {
    return "";
  }
  float place_mm = 0, normal = 0, sigma_mm = 0;
  for (std::size_t i = 0; i < before->size(); ++i) {
    place_mm = std::max(place_mm, (before->points[i] - after->points[i]).norm());
    normal = std::max(normal, (before->normals[i] - after->normals[i]).norm());
    sigma_mm = std::max(sigma_mm, std::abs(before->sigma_mm[i] - after->sigma_mm[i]));
  }
  return fmt::format("    of {} points at most: place {:.6f} mm, normal {:.6f}, sigma {:.6f} mm\n",
                     before->size(), place_mm, normal, sigma_mm);
}

class GoldenLog : public ::testing::Test {
 protected:
  GoldenLog() : truth_(ReadTruth()) {}

  void SetUp() override {
    auto session = RecordedSession::Open({(kSample / "axle.lcmlog").string()});
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(*session));
    EXPECT_THAT(session_->findings(), IsEmpty());
    auto scratch = ScratchFolder::Make();
    ASSERT_TRUE(scratch.ok()) << scratch.error().message;
    scratch_.emplace(std::move(*scratch));
    auto station = UnpackStation(*session_, {}, scratch_->path());
    ASSERT_TRUE(station.ok()) << station.error().message;
    station_.emplace(std::move(*station));
    const auto model = ReadBundle(station_->model);
    ASSERT_TRUE(model.ok()) << model.error().message;
    auto surface = TriangleIndex::Build(model->vertices, model->triangles);
    ASSERT_TRUE(surface.ok()) << surface.error().message;
    surface_.emplace(std::move(*surface));
  }

  std::size_t views() const { return truth_["views"].size(); }
  Eigen::Isometry3d part_from_array() const { return Pose(truth_["array_from_part"]).inverse(); }

  // What a service makes of its recorded inputs. Fails unless that is what it made of them when they were
  // recorded.
  Results Compute(const std::string& service) {
    Results results;
    ReplayOptions options;
    options.services = *SelectServices({service});
    options.on_result = [&results](const std::string& channel, ByteView message) {
      results[channel].emplace_back(message.begin(), message.end());
    };
    const auto outcome = Replay(*session_, *station_, options);
    EXPECT_TRUE(outcome.ok()) << outcome.error().message;
    if (outcome.ok()) {
      ExpectAsRecorded(service, *outcome);
    }
    return results;
  }

  void ExpectAsRecorded(const std::string& service, const ReplayOutcome& outcome) const {
    EXPECT_THAT(outcome.changed_inputs, IsEmpty());
    if (!outcome.comparison.Same()) {
      ADD_FAILURE()
          << Differences(service, outcome.comparison)
          << "Where that is meant, tools/golden-log records the session anew (logs/README.md). Where "
             "it is not, a change has altered results that it should have left alone.";
    }
    for (const auto& [channel, counts] : outcome.comparison.channels()) {
      const std::size_t expected = channel.starts_with("VIEW_") ? views() : 1;
      EXPECT_GE(static_cast<std::size_t>(counts.equal + counts.differing), expected)
          << channel << ": so many messages at least were to be compared";
    }
  }

  std::string Differences(const std::string& service, const ResultComparison& comparison) const {
    std::string text = fmt::format("The service {} does not compute what logs/sample holds.\n", service);
    for (const auto& [channel, counts] : comparison.channels()) {
      text += fmt::format("  {}: {} equal, {} differing, {} missing, {} extra\n", channel, counts.equal,
                          counts.differing, counts.missing, counts.extra);
    }
    if (const auto& first = comparison.first_difference(); first.has_value()) {
      text += fmt::format("  first difference: {} ({})\n",
                          MessageTitle(session_->types(), first->channel, first->recorded), first->where);
      for (const auto& line :
           FieldDifferences(session_->types(), first->recorded, first->replayed, kFieldsShown)) {
        text += fmt::format("    {}\n", line);
      }
      text += CloudDifference(first->recorded, first->replayed);
    }
    return text;
  }

  // Of the points to the design surface, mm; infinite for an empty cloud.
  double MedianDistanceMm(const PointCloud& cloud, const Eigen::Isometry3d& part_from_cloud,
                          double scale = 1.0) const {
    constexpr float kFarMm = 1000;
    std::vector<double> distances_mm;
    for (const Eigen::Vector3f& point : cloud.points) {
      const Eigen::Vector3d p_in_part = part_from_cloud * (scale * point.cast<double>());
      const auto nearest = surface_->Find(p_in_part.cast<float>(), kFarMm);
      distances_mm.push_back(nearest.has_value() ? nearest->distance_mm : kFarMm);
    }
    if (distances_mm.empty()) {
      return std::numeric_limits<double>::infinity();
    }
    const auto middle = distances_mm.begin() + static_cast<std::ptrdiff_t>(distances_mm.size() / 2);
    std::nth_element(distances_mm.begin(), middle, distances_mm.end());
    return *middle;
  }

  Json truth_;
  std::optional<RecordedSession> session_;
  std::optional<ScratchFolder> scratch_;
  std::optional<Station> station_;
  std::optional<TriangleIndex> surface_;
};

TEST_F(GoldenLog, files) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(kSample)) {
    bytes += entry.file_size();
  }
  EXPECT_LE(bytes, kMaxBytes);
  EXPECT_EQ(session_->opened().part, truth_["part"]);
  EXPECT_GT(views(), 0u);
}

TEST_F(GoldenLog, reconstruction) {
  const Results results = Compute("reconstruction");
  const auto said = As<fsmsg::view_result_t>(results, kViewResult.name);
  ASSERT_EQ(said.size(), views());
  const auto clouds = Clouds(results, kViewCloud.name);
  ASSERT_EQ(clouds.size(), views());
  const auto matrices = ViewMatrices::Load(station_->views);
  ASSERT_TRUE(matrices.ok()) << matrices.error().message;
  for (std::size_t i = 0; i < views(); ++i) {
    SCOPED_TRACE(fmt::format("view {}", i));
    EXPECT_EQ(said[i].status, fsmsg::view_result_t::STATUS_OK) << said[i].reason;
    EXPECT_EQ(said[i].frames_used, kFramesOfAView);
    const auto& [view, cloud_in_camera] = clouds[i];
    EXPECT_EQ(cloud_in_camera.size(), static_cast<std::size_t>(said[i].points));
    PointCloud cloud_in_array = cloud_in_camera;
    for (Eigen::Vector3f& point : cloud_in_array.points) {
      point = (matrices->array_from_camera.at(i) * point.cast<double>()).cast<float>();
    }
    const double hot_scale = truth_["views"][i]["scale"];
    EXPECT_LT(MedianDistanceMm(cloud_in_array, part_from_array(), 1.0 / hot_scale), kMedianDistanceMm);
  }
}

TEST_F(GoldenLog, fusion) {
  const Results results = Compute("fusion");
  const auto said = As<fsmsg::fusion_result_t>(results, kFusionResult.name);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0].status, fsmsg::view_result_t::STATUS_OK) << said[0].reason;
  EXPECT_EQ(said[0].frames_used, kFramesOfAView * static_cast<int>(views()));
  EXPECT_EQ(said[0].reference_degc, truth_["reference_temperature_degc"]);
  ASSERT_EQ(said[0].views.size(), views());
  for (std::size_t i = 0; i < views(); ++i) {
    const double hot_scale = truth_["views"][i]["scale"];
    EXPECT_NEAR(said[0].views[i].scale * hot_scale, 1.0, kScale) << "view " << i;
  }
  const auto clouds = Clouds(results, kFusedCloud.name);
  ASSERT_EQ(clouds.size(), 1u);
  EXPECT_EQ(clouds[0].second.size(), static_cast<std::size_t>(said[0].points));
  EXPECT_LT(MedianDistanceMm(clouds[0].second, part_from_array()), kMedianDistanceMm);
}

TEST_F(GoldenLog, registration) {
  const Results results = Compute("registration");
  const auto said = As<fsmsg::registration_t>(results, kRegistration.name);
  ASSERT_EQ(said.size(), 1u);
  ASSERT_EQ(said[0].status, fsmsg::registration_t::STATUS_CONVERGED) << said[0].reason;
  const Eigen::Isometry3d measured_from_true = Pose(said[0].model_from_array) * part_from_array().inverse();
  const double half_length_mm = 0.5 * truth_["dimensions"]["total_length"].get<double>();
  for (const double x_mm : {-half_length_mm, half_length_mm}) {
    const Eigen::Vector3d end(x_mm, 0, 0);
    EXPECT_LT((measured_from_true * end - end).norm(), kPoseMm) << "at x = " << x_mm;
  }
  const auto clouds = Clouds(results, kRegisteredCloud.name);
  ASSERT_EQ(clouds.size(), 1u);
  EXPECT_EQ(clouds[0].second.size(), static_cast<std::size_t>(said[0].points));
  EXPECT_LT(MedianDistanceMm(clouds[0].second, Eigen::Isometry3d::Identity()), kMedianDistanceMm);
}

TEST_F(GoldenLog, report) {
  const auto said = As<fsmsg::verdict_t>(Compute("report"), kVerdict.name);
  ASSERT_EQ(said.size(), 1u);
  ASSERT_EQ(truth_["verdict"], "OK") << "what follows is meant for a good part";
  EXPECT_EQ(said[0].verdict, fsmsg::verdict_t::VERDICT_OK) << said[0].reason;
  ASSERT_EQ(said[0].dimensions.size(), truth_["dimensions"].size());
  for (const auto& dimension : said[0].dimensions) {
    ASSERT_TRUE(truth_["dimensions"].contains(dimension.name)) << dimension.name;
    EXPECT_NEAR(dimension.measured_mm, truth_["dimensions"][dimension.name].get<double>(), kSizeMm)
        << dimension.name;
    EXPECT_EQ(dimension.verdict, fsmsg::verdict_t::VERDICT_OK) << dimension.name;
  }
}

}  // namespace
}  // namespace forgescan
