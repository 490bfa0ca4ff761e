// Median of many values, up to the width of a histogram bin: the same for any order in which the values come.
#pragma once

#include <algorithm>
#include <vector>

namespace forgescan {

class HistogramMedian {
 public:
  // Values outside [low, high] count in the first or last bin; NaN must not be added.
  HistogramMedian(double low, double high, int bins)
      : low_(low), width_((high - low) / bins), counts_(static_cast<std::size_t>(bins)) {}

  void Add(double value) {
    const double bin = std::clamp((value - low_) / width_, 0.0, static_cast<double>(counts_.size()) - 1);
    ++counts_[static_cast<std::size_t>(bin)];
    ++total_;
  }

  // The values of another one, of the same range and bins.
  void Add(const HistogramMedian& other) {
    for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
      counts_[bin] += other.counts_[bin];
    }
    total_ += other.total_;
  }

  long total() const { return total_; }

  // Interpolated inside the bin; only if total() > 0.
  double Median() const {
    const double half = static_cast<double>(total_) / 2;
    double below = 0;
    for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
      const auto here = static_cast<double>(counts_[bin]);
      if (below + here >= half && here > 0) {
        return low_ + width_ * (static_cast<double>(bin) + (half - below) / here);
      }
      below += here;
    }
    return low_;
  }

 private:
  double low_;
  double width_;
  std::vector<long> counts_;
  long total_ = 0;
};

}  // namespace forgescan
