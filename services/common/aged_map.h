// A small map that holds a bounded number of entries: whatever is left over when messages are lost or come
// late must not grow for ever. The oldest entry makes room, by order of insertion and not by key: parts may
// be counted from the beginning again.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

namespace forgescan {

// Cost: a search is linear; meant for tens of entries. References hold until the next Insert() or Take().
template <typename Key, typename Value>
class AgedMap {
 public:
  using Entry = std::pair<Key, Value>;

  // limit: at least 1.
  explicit AgedMap(std::size_t limit) : limit_(limit) {}

  std::size_t size() const { return entries_.size(); }
  Value* Find(const Key& key) {
    const auto found = Position(key);
    return found == entries_.end() ? nullptr : &found->second;
  }
  // Adds the entry as the youngest, in place of one with this key. Returns the oldest if it had to go.
  std::optional<Entry> Insert(const Key& key, Value value) {
    Take(key);
    std::optional<Entry> dropped;
    if (entries_.size() >= limit_) {
      dropped = std::move(entries_.front());
      entries_.pop_front();
    }
    entries_.emplace_back(key, std::move(value));
    return dropped;
  }
  std::optional<Value> Take(const Key& key) {
    const auto found = Position(key);
    if (found == entries_.end()) {
      return std::nullopt;
    }
    std::optional<Value> taken = std::move(found->second);
    entries_.erase(found);
    return taken;
  }
  // action(key, value), oldest first.
  template <typename Action>
  void ForEach(Action action) {
    for (auto& [key, value] : entries_) {
      action(key, value);
    }
  }
  template <typename Condition>
  void EraseIf(Condition condition) {
    std::erase_if(entries_, [&](const Entry& entry) { return condition(entry.first); });
  }

 private:
  auto Position(const Key& key) {
    return std::find_if(entries_.begin(), entries_.end(),
                        [&](const Entry& entry) { return entry.first == key; });
  }

  std::size_t limit_;
  std::deque<Entry> entries_;  // oldest first
};

}  // namespace forgescan
