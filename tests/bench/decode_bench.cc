// Decoding one camera's view of the shared set: 7 fringe frames and the white one, 2448 x 2048 of 8 bit, with
// noise. Every decoder must keep nearly all lit pixels, be as exact as the formula says and make no wrong
// fringe orders.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "services/reconstruction/fringe_decoder.h"
#include "tests/bench/decode_opencv.h"
#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {
namespace {

struct Case {
  ReconstructionConfig config;
  PatternSet pattern = StationPattern(Background::kShared);
  StationScene scene = RenderStation({2448, 2048}, pattern, config.noise);
};

const Case& TheCase() {
  static const Case only;
  return only;
}

FringeDecoder MakeDecoder(int threads, std::optional<SimdPath> path = BestSimdPath()) {
  ReconstructionConfig config = TheCase().config;
  config.threads = threads;
  auto decoder = FringeDecoder::Create(TheCase().pattern, config, path);
  if (!decoder.ok()) throw std::runtime_error(decoder.error().message);
  return std::move(decoder).value();
}

// Standard deviation of a coordinate fused with inverse variances, averaged over the phase: phases have 1
// and 1.5 (sigma / B)^2 with three frames and with two.
double ExpectedSigma(const Case& c, int row, int column) {
  const double rounding = 1.0 / 12;  // variance of whole grey values
  const double grey =
      std::sqrt(std::pow(c.config.noise.read_noise_dn, 2) + rounding +
                c.config.noise.gain_dn * static_cast<double>(c.scene.background_dn(row, column)));
  const double period_px = c.pattern.frequencies[1].period_px;
  const double variance = 1 / (1 + std::pow(63.0 / 64, 2) / 1.5 + std::pow(56.0 / 64, 2) / 1.5);
  return std::sqrt(variance) * grey / static_cast<double>(c.scene.modulation_dn(row, column)) * period_px /
         (2 * std::numbers::pi);
}

struct Accuracy {
  long lit = 0;
  long kept = 0;
  long unlit_kept = 0;
  long wrong_order = 0;
  double squares = 0;  // of errors over ExpectedSigma, wrong orders left out
};

// Sum of the squares of errors over what the decoder itself predicts, wrong orders left out.
double SquaresOverPredicted(const DecodedView& view) {
  const Case& c = TheCase();
  double squares = 0;
  for (int y = 0; y < view.cause.rows; ++y) {
    for (int x = 0; x < view.cause.cols; ++x) {
      if (view.cause(y, x) != static_cast<std::uint8_t>(MaskCause::kValid)) continue;
      const double off = static_cast<double>(view.coordinate_px(y, x)) - c.scene.columns(y, x);
      if (std::abs(off) > c.pattern.frequencies[1].period_px / 2) continue;
      squares += off * off / static_cast<double>(view.VariancePx2(y, x));
    }
  }
  return squares;
}

Accuracy Measure(const cv::Mat_<float>& coordinate_px, const cv::Mat_<std::uint8_t>& valid) {
  const Case& c = TheCase();
  Accuracy accuracy;
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      const bool lit = !std::isnan(c.scene.columns(y, x));
      accuracy.lit += lit;
      accuracy.unlit_kept += !lit && valid(y, x) != 0;
      if (!lit || valid(y, x) == 0) continue;
      ++accuracy.kept;
      const double off = static_cast<double>(coordinate_px(y, x)) - c.scene.columns(y, x);
      const bool wrong = std::abs(off) > c.pattern.frequencies[1].period_px / 2;
      accuracy.wrong_order += wrong;
      accuracy.squares += wrong ? 0 : std::pow(off / ExpectedSigma(c, y, x), 2);
    }
  }
  return accuracy;
}

void Judge(benchmark::State& state, const cv::Mat_<float>& coordinate_px,
           const cv::Mat_<std::uint8_t>& valid) {
  const Accuracy a = Measure(coordinate_px, valid);
  const double rms = std::sqrt(a.squares / static_cast<double>(a.kept));
  const double wrong = static_cast<double>(a.wrong_order) / static_cast<double>(a.kept);
  const double kept = static_cast<double>(a.kept) / static_cast<double>(a.lit);
  state.counters["rms_over_formula"] = rms;
  state.counters["wrong_order"] = wrong;
  state.counters["kept"] = kept;
  if (!(rms > 0.95 && rms < 1.05))
    state.SkipWithError("the coordinates are not as noisy as the formula says");
  if (!(wrong < 2e-5)) state.SkipWithError("too many wrong fringe orders");
  if (!(kept > 0.98)) state.SkipWithError("too many lit pixels are lost");
  if (a.unlit_kept > 0) state.SkipWithError("pixels without fringes were kept");
}

// As Reconstructor uses it: the maps of the view before are written over.
void BM_Ours(benchmark::State& state, int threads, std::optional<SimdPath> path) {
  const FringeDecoder decoder = MakeDecoder(threads, path);
  DecodedView view;
  for (auto _ : state) {
    decoder.Recycle(std::move(view));
    auto result = decoder.Decode(TheCase().scene.frames);
    if (!result.ok()) return state.SkipWithError(result.error().message.c_str());
    view = std::move(result).value();
  }
  state.SetLabel(path ? std::string(NameOf(*path)) : "plain");
  const cv::Mat valid = view.cause == static_cast<std::uint8_t>(MaskCause::kValid);
  Judge(state, view.coordinate_px, valid);
  const double predicted = std::sqrt(SquaresOverPredicted(view) / static_cast<double>(view.count[0]));
  state.counters["rms_over_predicted"] = predicted;
  if (!(predicted > 0.95 && predicted < 1.05))
    state.SkipWithError("the predicted noise is not that of the coordinates");
}

// rows: how many the arrays hold; a view is done block by block.
void BM_OpenCv(benchmark::State& state, int rows) {
  cv::setNumThreads(1);
  const Case& c = TheCase();
  const FringeDecoder decoder = MakeDecoder(1);
  OpenCvDecoder opencv(decoder, c.config);
  cv::Mat_<float> coordinate_px(c.scene.columns.size());
  cv::Mat_<std::uint8_t> valid(c.scene.columns.size());
  for (auto _ : state) {
    for (int row = 0; row < valid.rows; row += rows) {
      const cv::Range block(row, row + rows);
      std::vector<cv::Mat> frames;
      for (const cv::Mat& frame : c.scene.frames) frames.push_back(frame.rowRange(block));
      opencv.Decode(frames, coordinate_px.rowRange(block), valid.rowRange(block));
    }
  }
  Judge(state, coordinate_px, valid);
}

void Register(const std::string& name, int threads, std::optional<SimdPath> path) {
  benchmark::RegisterBenchmark(name.c_str(), BM_Ours, threads, path)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

void RegisterAll() {
  Register("decode/ours", 1, BestSimdPath());
  Register("decode/ours/threads:2", 2, BestSimdPath());
  Register("decode_reference/ours", 1, std::nullopt);
  for (const SimdPath path : AvailableSimdPaths()) {
    Register(fmt::format("decode_path/{}", NameOf(path)), 1, path);
  }
  for (const auto& [name, rows] :
       {std::pair{"decode/opencv_arrays", 2048}, std::pair{"decode/opencv_blocks", 16}}) {
    benchmark::RegisterBenchmark(name, BM_OpenCv, rows)->Unit(benchmark::kMillisecond)->UseRealTime();
  }
}

}  // namespace
}  // namespace forgescan

int main(int argc, char** argv) {
  forgescan::RegisterAll();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
