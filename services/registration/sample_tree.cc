#include "services/registration/sample_tree.h"

#include <cmath>
#include <flann/flann.hpp>

namespace forgescan {

struct SampleTree::Tree {
  explicit Tree(std::vector<Eigen::Vector3f>& points)
      : index(flann::Matrix<float>(points.front().data(), points.size(), 3),
              flann::KDTreeSingleIndexParams(12)) {
    index.buildIndex();
  }
  flann::KDTreeSingleIndex<flann::L2_Simple<float>> index;
};

SampleTree::SampleTree(std::vector<Eigen::Vector3f> points)
    : points_(std::move(points)), tree_(std::make_unique<Tree>(points_)) {}
SampleTree::~SampleTree() = default;

std::vector<NearestSample> SampleTree::Find(std::span<const Eigen::Vector3f> queries) const {
  std::vector<NearestSample> nearest(queries.size());
  if (queries.empty()) return nearest;
  std::vector<std::size_t> samples(queries.size());
  std::vector<float> squared(queries.size());
  // FLANN's matrices are not const-correct; a search does not write to its queries.
  flann::Matrix<float> query_matrix(const_cast<float*>(queries.front().data()), queries.size(), 3);
  flann::Matrix<std::size_t> sample_matrix(samples.data(), samples.size(), 1);
  flann::Matrix<float> squared_matrix(squared.data(), squared.size(), 1);
  tree_->index.knnSearch(query_matrix, sample_matrix, squared_matrix, 1,
                         flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED, 0.0F));
  for (std::size_t i = 0; i < queries.size(); ++i) {
    nearest[i] = {static_cast<std::uint32_t>(samples[i]), std::sqrt(squared[i])};
  }
  return nearest;
}

}  // namespace forgescan
