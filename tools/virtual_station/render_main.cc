// forgescan-virtual-render: writes the virtual station's folder, or renders the images of one view, for
// trying the reconstruction without the line.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "tools/virtual_station/station_writer.h"
#include "tools/virtual_station/truth.h"

namespace {

using namespace forgescan;

struct Arguments {
  std::string cell = "stations/virtual/cell.toml";
  std::string station_out, images, set = "reduced";
  int part = 0, view = 0, scale_divisor = 0, threads = 2;
};

// Pacing of a demonstration, not a time of the simulation.
double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

ProjectedSet SetOf(const Arguments& arguments) {
  return arguments.set == "full" ? ProjectedSet::kFull : ProjectedSet::kReduced;
}

void CountPoints(const GeometryMap& map) {
  std::size_t part = 0, cell = 0;
  for (std::size_t i = 0; i < map.sample.size(); ++i) {
    const bool usable = map.sample[i].lit > 30.0f;
    part += usable && map.surface[i] == Surface::kPart ? 1 : 0;
    cell += usable && map.surface[i] == Surface::kCell ? 1 : 0;
  }
  std::printf("  lit pixels: part %zu, foreign %zu (%.1f %%), outline %zu\n", part, cell,
              100.0 * static_cast<double>(cell) / static_cast<double>(part + cell + 1), map.edges.size());
}

Status RenderSide(const VirtualCell& cell, const PartState& part, const ViewState& view, Side side,
                  const Arguments& arguments) {
  const std::filesystem::path folder =
      std::filesystem::path(arguments.images) / (side == Side::kLeft ? "left" : "right");
  std::filesystem::create_directories(folder);
  const double start = Seconds();
  ASSIGN_OR_RETURN(const GeometryMap map, cell.Map(part, view, side));
  const double mapped = Seconds();
  CountPoints(map);
  const std::vector<Pattern> patterns = cell.Patterns(SetOf(arguments));
  double exposing = 0.0;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const double before = Seconds();
    std::vector<std::uint8_t> grey = cell.Image(map, view, side, patterns[i], static_cast<int>(i));
    exposing += Seconds() - before;
    const std::string path = (folder / fmt::format("pattern_{:02}.png", i)).string();
    if (!cv::imwrite(path, cv::Mat(map.height, map.width, CV_8UC1, grey.data()))) {
      return Fail(ErrorCode::kIo, "{}: could not be written", path);
    }
  }
  std::printf("  geometry %.0f ms, %zu images %.0f ms\n", 1e3 * (mapped - start), patterns.size(),
              1e3 * exposing);
  return {};
}

Status Run(const Arguments& arguments) {
  ASSIGN_OR_RETURN(CellConfig config, LoadCellConfig(arguments.cell, arguments.scale_divisor));
  if (!arguments.station_out.empty()) {
    RETURN_IF_ERROR(WriteStation(config, SetOf(arguments), arguments.station_out));
  }
  if (arguments.images.empty()) {
    return {};
  }
  const VirtualCell cell(std::move(config), arguments.threads);
  ASSIGN_OR_RETURN(const PartState part, cell.Part(arguments.part));
  ASSIGN_OR_RETURN(const ViewState view, cell.View(part, arguments.view));
  std::printf("part %d view %d\n", arguments.part, arguments.view);
  RETURN_IF_ERROR(RenderSide(cell, part, view, Side::kLeft, arguments));
  RETURN_IF_ERROR(RenderSide(cell, part, view, Side::kRight, arguments));
  return WriteTruth(cell, part, (std::filesystem::path(arguments.images) / "truth.json").string());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Renders the virtual station's images and writes its station folder"};
  Arguments arguments;
  app.add_option("--cell", arguments.cell, "configuration of the cell")->capture_default_str();
  app.add_option("--station-out", arguments.station_out, "folder for calibration, pattern, views and model");
  app.add_option("--images", arguments.images, "folder for left/, right/ and truth.json");
  app.add_option("--part", arguments.part, "number of the part, from 0")->capture_default_str();
  app.add_option("--view", arguments.view, "number of the view, from 0")->capture_default_str();
  app.add_option("--set", arguments.set, "patterns")
      ->check(CLI::IsMember({"reduced", "full"}))
      ->capture_default_str();
  app.add_option("--scale-divisor", arguments.scale_divisor, "1, 2, 4 or 8 instead of the configuration's");
  app.add_option("--threads", arguments.threads)->check(CLI::Range(1, 64))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    const Status outcome = Run(arguments);
    if (!outcome.ok()) {
      std::fprintf(stderr, "forgescan-virtual-render: %s\n", outcome.error().message.c_str());
      return 1;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "forgescan-virtual-render: %s\n", error.what());
    return 1;
  }
  return 0;
}
