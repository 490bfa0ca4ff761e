#include "tests/fuzz/random_message.h"

#include <random>

namespace forgescan::fuzz {
namespace {

class Writer {
 public:
  Writer(const LcmTypes& types, std::uint64_t seed) : types_(types), random_(seed) {}

  void Integer(std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = bytes; i-- > 0;) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }

  void Struct(const LcmStruct& type) {
    std::vector<std::uint64_t> integers(type.fields.size());
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const LcmField& field = type.fields[i];
      std::uint64_t elements = 1;
      for (const LcmDimension& dimension : field.dimensions) {
        elements *=
            dimension.fixed > 0 ? static_cast<std::uint64_t>(dimension.fixed) : integers[dimension.counter];
      }
      integers[i] = IsCounter(type, i) ? random_() % 4 : random_();
      for (std::uint64_t k = 0; k < elements; ++k) One(field, integers[i]);
    }
  }

  Bytes Take() && { return std::move(bytes_); }

 private:
  static bool IsCounter(const LcmStruct& type, std::size_t index) {
    for (const LcmField& field : type.fields) {
      for (const LcmDimension& dimension : field.dimensions) {
        if (dimension.fixed == 0 && dimension.counter == index) return true;
      }
    }
    return false;
  }

  void One(const LcmField& field, std::uint64_t value) {
    if (!field.primitive) return Struct(*types_.Find(field.type));
    switch (*field.primitive) {
      case LcmPrimitive::kString:
        Integer(5, 4);
        for (const char letter : {'t', 'e', 'x', 't', '\0'}) Integer(static_cast<std::uint64_t>(letter), 1);
        return;
      case LcmPrimitive::kBoolean:
        return Integer(value % 2, 1);
      case LcmPrimitive::kInt8:
      case LcmPrimitive::kByte:
        return Integer(value, 1);
      case LcmPrimitive::kInt16:
        return Integer(value, 2);
      case LcmPrimitive::kInt32:
      case LcmPrimitive::kFloat:
        return Integer(value, 4);
      case LcmPrimitive::kInt64:
      case LcmPrimitive::kDouble:
        return Integer(value, 8);
    }
  }

  const LcmTypes& types_;
  std::mt19937_64 random_;
  Bytes bytes_;
};

}  // namespace

Bytes RandomMessage(const LcmTypes& types, const LcmStruct& type, std::uint64_t seed) {
  Writer writer(types, seed);
  writer.Integer(static_cast<std::uint64_t>(types.Fingerprint(type)), 8);
  writer.Struct(type);
  return std::move(writer).Take();
}

}  // namespace forgescan::fuzz
