// The virtual cell as the whole-line tests need it: the station's files, and the images and truth of its
// parts, rendered at a quarter of the size (612 x 512 px), once for all tests of a program. Its header names
// nothing of the simulator.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "services/common/result.h"

namespace forgescan::testing {

// Whether the station corrects the robot's error by the posts of the cell, as stations/virtual does. A scan
// of the empty cell costs 4 s.
enum class StandingPosts { kNotUsed, kUsed };

struct RenderedView {
  using Image = std::vector<std::uint8_t>;
  double pyrometer_degc = 0;
  std::array<std::vector<Image>, 2> images;  // left, right; by pattern
};

class RenderedCell {
 public:
  // Makes the folder of the station stations/virtual as a run of it would have, model bundle included; it
  // goes with the object. Cost: about 5 s. Errors: kIo, and those of the simulator.
  static Result<std::unique_ptr<RenderedCell>> Create(StandingPosts posts = StandingPosts::kNotUsed);
  ~RenderedCell();

  const std::filesystem::path& folder() const { return folder_; }
  int width_px() const;
  int height_px() const;
  int view_count() const;
  std::uint32_t path_crc32() const;

  // From now on this part is not there: a scan of the empty cell.
  void TakeAway(int part) { taken_away_.insert(part); }
  // Renders at the first call; parts from 1. Errors: those of the simulator.
  Result<const RenderedView*> View(int part, int view);
  // Sizes by the names of features.toml, mm at the reference temperature.
  Result<std::map<std::string, double>> TrueSizesMm(int part) const;

 private:
  struct Cell;
  RenderedCell(std::unique_ptr<Cell> cell, std::filesystem::path folder);

  std::unique_ptr<Cell> cell_;
  std::filesystem::path folder_;
  std::map<std::pair<int, int>, RenderedView> views_;  // part, view
  std::set<int> taken_away_;
};

}  // namespace forgescan::testing
