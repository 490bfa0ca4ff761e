#include "services/common/model/bundle_file.h"

#include <libdeflate.h>

#include <cstring>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>

#include "services/common/model/mapped_file.h"
#include "services/common/output_file.h"

namespace forgescan {
namespace {

constexpr char kMagic[] = "FSBUNDLE";
constexpr std::size_t kMagicSize = 8;
constexpr std::size_t kHeaderSize = kMagicSize + 4 + 4 + 8;
constexpr std::uint32_t kVersion = 2;

template <typename T>
void Put(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void PutVector(std::string& bytes, const Eigen::Vector3d& v) {
  bytes.append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(double));
}

template <typename T>
void PutArray(std::string& bytes, std::span<const T> values) {
  Put(bytes, static_cast<std::uint64_t>(values.size()));
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <typename T>
void PutArray(std::string& bytes, const std::vector<T>& values) {
  PutArray(bytes, std::span<const T>(values));
}

// Everything before it in the payload has a multiple of 4 bytes, so that the words can be used where they
// are.
void PutGrid(std::string& bytes, const SurfaceGridArrays& grid) {
  for (int axis = 0; axis < 3; ++axis) Put(bytes, grid.low[axis]);
  Put(bytes, grid.voxel_mm);
  Put(bytes, grid.band_mm);
  for (const std::uint32_t bricks : grid.bricks) Put(bytes, bricks);
  PutArray(bytes, grid.tops);
  PutArray(bytes, grid.voxels);
  PutArray(bytes, grid.lists);
}

// Reads forward through the payload; after the first read past the end, ok() stays false and values stay
// zero.
class Cursor {
 public:
  explicit Cursor(std::string_view bytes, std::size_t at) : bytes_(bytes), at_(at) {}
  bool ok() const { return ok_; }
  bool AtEnd() const { return ok_ && at_ == bytes_.size(); }

  template <typename T>
  T Take() {
    T value{};
    Copy(&value, sizeof value);
    return value;
  }
  Eigen::Vector3d TakeVector() {
    Eigen::Vector3d v = Eigen::Vector3d::Zero();
    Copy(v.data(), 3 * sizeof(double));
    return v;
  }
  template <typename T>
  std::vector<T> TakeArray() {
    const auto count = Take<std::uint64_t>();
    if (!ok_ || count > (bytes_.size() - at_) / sizeof(T)) {
      ok_ = false;
      return {};
    }
    std::vector<T> values(count);
    Copy(values.data(), count * sizeof(T));
    return values;
  }
  // The words where they are. Their place must be a multiple of 4 bytes in memory.
  std::span<const std::uint32_t> TakeWords() {
    const auto count = Take<std::uint64_t>();
    if (!ok_ || count > (bytes_.size() - at_) / sizeof(std::uint32_t)) {
      ok_ = false;
      return {};
    }
    const auto* first = reinterpret_cast<const std::uint32_t*>(bytes_.data() + at_);
    at_ += count * sizeof(std::uint32_t);
    return {first, count};
  }
  std::string TakeString() {
    const auto characters = TakeArray<char>();
    return {characters.begin(), characters.end()};
  }

 private:
  void Copy(void* target, std::size_t size) {
    ok_ = ok_ && size <= bytes_.size() - at_;
    if (!ok_ || size == 0) return;
    std::memcpy(target, bytes_.data() + at_, size);
    at_ += size;
  }

  std::string_view bytes_;
  std::size_t at_;
  bool ok_ = true;
};

std::string EncodePayload(const ModelBundle& bundle) {
  std::string bytes;
  Put(bytes, bundle.spacing_mm);
  Put(bytes, bundle.resolution_mm);
  Put(bytes, bundle.chord_error_mm);
  PutGrid(bytes, bundle.grid.arrays());
  Put(bytes, static_cast<std::uint64_t>(bundle.faces.size()));
  for (const ModelFace& face : bundle.faces) {
    PutArray(bytes, std::vector<char>(face.name.begin(), face.name.end()));
    Put(bytes, static_cast<std::uint32_t>(face.type));
    PutVector(bytes, face.point);
    PutVector(bytes, face.direction);
    Put(bytes, face.radius_mm);
    Put(bytes, face.first_triangle);
    Put(bytes, face.triangle_count);
  }
  PutArray(bytes, bundle.vertices);
  PutArray(bytes, bundle.triangles);
  PutArray(bytes, bundle.sample_points);
  PutArray(bytes, bundle.sample_normals);
  return bytes;
}

Result<ModelFace> TakeFace(Cursor& cursor) {
  ModelFace face;
  face.name = cursor.TakeString();
  const auto type = cursor.Take<std::uint32_t>();
  if (type > kLastFaceType)
    return Fail(ErrorCode::kFormat, "the model bundle has a face of unknown type {}", type);
  face.type = static_cast<FaceType>(type);
  face.point = cursor.TakeVector();
  face.direction = cursor.TakeVector();
  face.radius_mm = cursor.Take<double>();
  face.first_triangle = cursor.Take<std::uint32_t>();
  face.triangle_count = cursor.Take<std::uint32_t>();
  return face;
}

SurfaceGridArrays TakeGrid(Cursor& cursor) {
  SurfaceGridArrays grid;
  for (int axis = 0; axis < 3; ++axis) grid.low[axis] = cursor.Take<float>();
  grid.voxel_mm = cursor.Take<float>();
  grid.band_mm = cursor.Take<float>();
  for (std::uint32_t& bricks : grid.bricks) bricks = cursor.Take<std::uint32_t>();
  grid.tops = cursor.TakeWords();
  grid.voxels = cursor.TakeWords();
  grid.lists = cursor.TakeWords();
  return grid;
}

// `memory` owns the bytes the cursor reads.
Result<ModelBundle> DecodePayload(Cursor& cursor, std::shared_ptr<const void> memory) {
  ModelBundle bundle;
  bundle.spacing_mm = cursor.Take<double>();
  bundle.resolution_mm = cursor.Take<double>();
  bundle.chord_error_mm = cursor.Take<double>();
  bundle.grid = SurfaceGrid(TakeGrid(cursor), std::move(memory));
  const auto faces = cursor.Take<std::uint64_t>();
  for (std::uint64_t i = 0; i < faces && cursor.ok(); ++i) {
    ASSIGN_OR_RETURN(ModelFace face, TakeFace(cursor));
    bundle.faces.push_back(std::move(face));
  }
  bundle.vertices = cursor.TakeArray<Eigen::Vector3f>();
  bundle.triangles = cursor.TakeArray<TriangleCorners>();
  bundle.sample_points = cursor.TakeArray<Eigen::Vector3f>();
  bundle.sample_normals = cursor.TakeArray<Eigen::Vector3f>();
  if (!cursor.AtEnd())
    return Fail(ErrorCode::kFormat, "the model bundle's counts do not add up to its length");
  return bundle;
}

Status CheckHeader(std::string_view bytes) {
  if (bytes.size() < kHeaderSize || bytes.compare(0, kMagicSize, kMagic) != 0) {
    return Fail(ErrorCode::kFormat, "not a model bundle: it does not begin with {} and a header", kMagic);
  }
  Cursor cursor(bytes, kMagicSize);
  const auto version = cursor.Take<std::uint32_t>();
  const auto expected_crc = cursor.Take<std::uint32_t>();
  const auto size = cursor.Take<std::uint64_t>();
  if (version != kVersion) {
    return Fail(ErrorCode::kFormat,
                "model bundle of version {}, this program reads version {}: prepare the model anew with "
                "forgescan model import",
                version, kVersion);
  }
  if (size != bytes.size() - kHeaderSize) {
    return Fail(ErrorCode::kFormat, "model bundle with {} bytes of payload, its header says {}",
                bytes.size() - kHeaderSize, size);
  }
  const std::uint32_t crc = libdeflate_crc32(0, bytes.data() + kHeaderSize, size);
  if (crc == expected_crc) return {};
  return Fail(ErrorCode::kFormat, "model bundle is damaged: CRC-32 {:08x}, its header says {:08x}", crc,
              expected_crc);
}

Result<ModelBundle> DecodeShared(std::string_view bytes, std::shared_ptr<const void> memory) {
  RETURN_IF_ERROR(CheckHeader(bytes));
  Cursor cursor(bytes, kHeaderSize);
  ASSIGN_OR_RETURN(ModelBundle bundle, DecodePayload(cursor, std::move(memory)));
  bundle.checksum = Cursor(bytes, kMagicSize + 4).Take<std::uint32_t>();
  RETURN_IF_ERROR(Check(bundle));
  return bundle;
}

}  // namespace

std::string EncodeBundle(const ModelBundle& bundle) {
  const std::string payload = EncodePayload(bundle);
  std::string bytes(kMagic, kMagicSize);
  Put(bytes, kVersion);
  Put(bytes, libdeflate_crc32(0, payload.data(), payload.size()));
  Put(bytes, static_cast<std::uint64_t>(payload.size()));
  return bytes + payload;
}

Result<ModelBundle> DecodeBundle(const std::string& bytes) {
  // A string's bytes begin at a multiple of 8.
  const auto owned = std::make_shared<const std::string>(bytes);
  return DecodeShared(*owned, owned);
}

Status WriteBundle(const ModelBundle& bundle, const std::filesystem::path& path) {
  return WriteOutputFile(path, EncodeBundle(bundle));
}

Result<ModelBundle> ReadBundle(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const auto file, MappedFile::Open(path));
  auto bundle = DecodeShared(file->bytes(), file);
  if (bundle.ok()) return bundle;
  return Fail(bundle.error().code, "{}: {}", path.string(), bundle.error().message);
}

}  // namespace forgescan
