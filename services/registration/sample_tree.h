// The paper's search: the nearest sample of the model, by an exact k-d tree. Not used by the production
// registration, which asks the surface itself (RegistrationModel::FindSurface).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace forgescan {

struct NearestSample {
  std::uint32_t sample;
  float distance_mm;
};

// Source: section 2.2.2, step 2. FLANN's single k-d tree without approximation. Built once, read-only
// afterwards: any number of threads may ask at the same time. Units: mm.
class SampleTree {
 public:
  // At least one point; all finite.
  explicit SampleTree(std::vector<Eigen::Vector3f> points);
  ~SampleTree();
  SampleTree(const SampleTree&) = delete;
  SampleTree& operator=(const SampleTree&) = delete;

  // The queries must be finite.
  std::vector<NearestSample> Find(std::span<const Eigen::Vector3f> queries) const;

 private:
  struct Tree;
  std::vector<Eigen::Vector3f> points_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace forgescan
