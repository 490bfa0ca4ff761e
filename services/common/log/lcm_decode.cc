#include "services/common/log/lcm_decode.h"

#include <bit>
#include <cmath>

#include "services/common/bus/big_endian.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

class Decoder {
 public:
  Decoder(const LcmTypes& types, ByteView rest)
      : types_(types), rest_(rest), values_left_(kValuesPerByte * rest.size() + kMoreValues) {}

  bool at_end() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

  Result<Json> Struct(const LcmStruct& type, std::size_t depth) {
    if (depth > kMaxLcmDepth) {  // a type may contain itself
      return Fail(ErrorCode::kFormat, "{} contains more than {} structs in each other", type.name,
                  kMaxLcmDepth);
    }
    Json object = Json::object();
    auto& members = object.get_ref<Json::object_t&>();
    std::vector<std::int64_t> integers(type.fields.size());  // for the sizes of later fields
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const LcmField& field = type.fields[i];
      std::vector<std::int64_t> sizes;
      for (const LcmDimension& dimension : field.dimensions) {
        sizes.push_back(dimension.fixed > 0 ? dimension.fixed : integers[dimension.counter]);
      }
      auto value = Array(field, sizes, depth);
      if (!value.ok()) {
        const bool is_own = value.error().message.starts_with(' ');  // else of a field of a struct within
        return Fail(ErrorCode::kFormat, "{}{}{}", field.name, is_own ? "" : ".", value.error().message);
      }
      if (value->is_number_integer()) {
        integers[i] = value->get<std::int64_t>();
      }
      members.emplace_back(field.name, std::move(*value));  // names differ: no search for each
    }
    return object;
  }

 private:
  // An array of nothing, or a struct of nothing, takes no bytes: the bytes alone bound nothing. Structs in
  // structs have several values a byte.
  static constexpr std::size_t kValuesPerByte = 4, kMoreValues = 10'000;

  Result<Json> Array(const LcmField& field, std::span<const std::int64_t> sizes, std::size_t depth) {
    if (values_left_-- == 0) {
      return Fail(ErrorCode::kFormat, " has more values than the message can hold");
    }
    if (sizes.empty()) {
      return One(field, depth);
    }
    if (sizes[0] < 0 || static_cast<std::uint64_t>(sizes[0]) > rest_.size()) {
      return Fail(ErrorCode::kFormat, " has {} elements, and {} bytes are left", sizes[0], rest_.size());
    }
    const auto count = static_cast<std::size_t>(sizes[0]);
    if (field.primitive == LcmPrimitive::kByte && sizes.size() == 1) {
      const ByteView bytes = rest_.first(count);
      rest_ = rest_.subspan(count);
      return Json::binary({bytes.begin(), bytes.end()});
    }
    Json array = Json::array();
    for (std::size_t i = 0; i < count; ++i) {
      ASSIGN_OR_RETURN(array.emplace_back(), Array(field, sizes.subspan(1), depth));
    }
    return array;
  }

  Result<Json> One(const LcmField& field, std::size_t depth) {
    if (!field.primitive) {
      return Struct(*types_.Find(field.type), depth + 1);
    }
    switch (*field.primitive) {
      case LcmPrimitive::kInt8:
        return Integer<std::int8_t>();
      case LcmPrimitive::kInt16:
        return Integer<std::int16_t>();
      case LcmPrimitive::kInt32:
        return Integer<std::int32_t>();
      case LcmPrimitive::kInt64:
        return Integer<std::int64_t>();
      case LcmPrimitive::kByte:
        return Integer<std::uint8_t>();
      case LcmPrimitive::kFloat:
        return Real<float, std::uint32_t>();
      case LcmPrimitive::kDouble:
        return Real<double, std::uint64_t>();
      case LcmPrimitive::kString:
        return String();
      case LcmPrimitive::kBoolean:
        break;
    }
    ASSIGN_OR_RETURN(const std::int8_t value, Take<std::int8_t>());
    return Json(value != 0);
  }

  template <typename T>
  Result<T> Take() {
    if (rest_.size() < sizeof(T)) {
      return Fail(ErrorCode::kFormat, " has {} bytes, and {} are left", sizeof(T), rest_.size());
    }
    const T value = BigEndianAt<T>(rest_, 0);
    rest_ = rest_.subspan(sizeof(T));
    return value;
  }
  template <typename T>
  Result<Json> Integer() {
    ASSIGN_OR_RETURN(const T value, Take<T>());
    return Json(value);
  }
  template <typename T, typename Bits>
  Result<Json> Real() {
    ASSIGN_OR_RETURN(const Bits bits, Take<Bits>());
    const T value = std::bit_cast<T>(bits);
    return std::isfinite(value) ? Json(value) : Json();
  }
  Result<Json> String() {
    ASSIGN_OR_RETURN(const std::int32_t size, Take<std::int32_t>());
    if (size < 1 || static_cast<std::size_t>(size) > rest_.size()) {  // the zero at its end counts
      return Fail(ErrorCode::kFormat, " is a string of {} bytes, and {} are left", size, rest_.size());
    }
    const ByteView bytes = rest_.first(static_cast<std::size_t>(size));
    rest_ = rest_.subspan(bytes.size());
    return Json(std::string(bytes.begin(), bytes.end() - 1));
  }

  const LcmTypes& types_;
  ByteView rest_;
  std::size_t values_left_;
};

}  // namespace

Result<Json> DecodeToJson(const LcmTypes& types, ByteView message) {
  const LcmStruct* type = types.TypeOf(message);
  if (type == nullptr) {
    return Fail(ErrorCode::kFormat, "{} bytes are of no known type", message.size());
  }
  Decoder decoder(types, message.subspan(sizeof(std::int64_t)));
  auto value = decoder.Struct(*type, 0);
  if (!value.ok()) {
    return Fail(ErrorCode::kFormat, "{} bytes do not decode as {}: {}", message.size(), type->name,
                value.error().message);
  }
  if (!decoder.at_end()) {
    return Fail(ErrorCode::kFormat, "{} bytes do not decode as {}: {} bytes too many", message.size(),
                type->name, decoder.left());
  }
  return value;
}

}  // namespace forgescan
