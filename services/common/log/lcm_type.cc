#include "services/common/log/lcm_type.h"

#include <algorithm>
#include <array>

#include "services/common/bus/big_endian.h"

namespace forgescan {
namespace {

// How lcm-gen folds a byte into a hash: the shift to the right is that of a signed number, and bytes are
// signed.
std::uint64_t Fold(std::uint64_t hash, std::size_t byte) {
  const auto high = static_cast<std::uint64_t>(static_cast<std::int64_t>(hash) >> 55);
  return ((hash << 8) ^ high) + static_cast<std::uint64_t>(static_cast<std::int8_t>(byte));
}

std::uint64_t Fold(std::uint64_t hash, std::string_view text) {
  hash = Fold(hash, text.size());
  for (const char c : text) {
    hash = Fold(hash, static_cast<unsigned char>(c));
  }
  return hash;
}

std::uint64_t HashOfOwnFields(const LcmStruct& type) {
  std::uint64_t hash = 0x12345678;
  for (const LcmField& field : type.fields) {
    hash = Fold(hash, field.name);
    if (field.primitive) {
      hash = Fold(hash, field.type);
    }
    hash = Fold(hash, field.dimensions.size());
    for (const LcmDimension& dimension : field.dimensions) {
      hash = Fold(hash, std::size_t{dimension.fixed == 0 ? 1U : 0U});
      hash = Fold(hash, dimension.size);
    }
  }
  return hash;
}

// Structs within structs, each as often as it occurs. Twenty types that contain each other twice are a
// million: a text from a damaged log must not keep us busy for ever.
constexpr int kMaxNested = 5000;

// Counts `left` down for each struct within the type; negative = too many, or too deep.
void CountNested(const LcmTypes& types, const LcmStruct& type, std::vector<const LcmStruct*>& within,
                 int& left) {
  if (std::find(within.begin(), within.end(), &type) != within.end()) {
    return;
  }
  left = within.size() > kMaxLcmDepth ? -1 : left - 1;
  within.push_back(&type);
  for (const LcmField& field : type.fields) {
    if (!field.primitive && left >= 0) {
      CountNested(types, *types.Find(field.type), within, left);
    }
  }
  within.pop_back();
}

Status CheckNesting(const LcmTypes& types) {
  for (const LcmStruct& type : types.structs()) {
    std::vector<const LcmStruct*> within;
    int left = kMaxNested;
    CountNested(types, type, within, left);
    if (left < 0) {
      return Fail(ErrorCode::kFormat, "{} contains more than {} structs, or structs more than {} deep",
                  type.name, kMaxNested, kMaxLcmDepth);
    }
  }
  return {};
}

}  // namespace

bool LcmStruct::IsStream() const {
  constexpr std::array<std::pair<const char*, LcmPrimitive>, 4> kHeader{{{"utime", LcmPrimitive::kInt64},
                                                                         {"session", LcmPrimitive::kInt64},
                                                                         {"sequence", LcmPrimitive::kInt64},
                                                                         {"crc32", LcmPrimitive::kInt32}}};
  return fields.size() >= kHeader.size() &&
         std::equal(kHeader.begin(), kHeader.end(), fields.begin(), [](const auto& a, const LcmField& b) {
           return b.name == a.first && b.primitive == a.second && b.dimensions.empty();
         });
}

Result<LcmTypes> LcmTypes::Parse(std::string_view text) {
  LcmTypes types;
  ASSIGN_OR_RETURN(types.structs_, ParseLcmDefinitions(text));
  for (std::size_t i = 0; i < types.structs_.size(); ++i) {
    if (!types.by_name_.try_emplace(types.structs_[i].name, i).second) {
      return Fail(ErrorCode::kFormat, "the type {} is defined twice", types.structs_[i].name);
    }
  }
  for (const LcmStruct& type : types.structs_) {
    for (const LcmField& field : type.fields) {
      if (!field.primitive && types.Find(field.type) == nullptr) {
        return Fail(ErrorCode::kFormat, "{}.{} is of the type {}, which is not defined", type.name,
                    field.name, field.type);
      }
    }
  }
  RETURN_IF_ERROR(CheckNesting(types));
  std::transform(types.structs_.begin(), types.structs_.end(), std::back_inserter(types.own_hashes_),
                 HashOfOwnFields);
  for (std::size_t i = 0; i < types.structs_.size(); ++i) {
    types.by_fingerprint_.try_emplace(types.Fingerprint(types.structs_[i]), i);
  }
  return types;
}

const LcmStruct* LcmTypes::Find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : &structs_[found->second];
}

const LcmStruct* LcmTypes::FindByFingerprint(std::int64_t fingerprint) const {
  const auto found = by_fingerprint_.find(fingerprint);
  return found == by_fingerprint_.end() ? nullptr : &structs_[found->second];
}

const LcmStruct* LcmTypes::TypeOf(ByteView message) const {
  return message.size() < sizeof(std::int64_t) ? nullptr
                                               : FindByFingerprint(BigEndianAt<std::int64_t>(message, 0));
}

std::int64_t LcmTypes::Fingerprint(const LcmStruct& type) const {
  std::vector<const LcmStruct*> within;
  return static_cast<std::int64_t>(Hash(type, within));
}

std::uint64_t LcmTypes::Hash(const LcmStruct& type, std::vector<const LcmStruct*>& within) const {
  if (std::find(within.begin(), within.end(), &type) != within.end()) {
    return 0;
  }
  within.push_back(&type);
  std::uint64_t hash = own_hashes_[static_cast<std::size_t>(&type - structs_.data())];
  for (const LcmField& field : type.fields) {
    if (!field.primitive) {
      hash += Hash(*Find(field.type), within);
    }
  }
  within.pop_back();
  return (hash << 1) + (hash >> 63);
}

}  // namespace forgescan
