/// \file
/// Contents that a disk may have after its power was cut: of what a program wrote, the part that it
/// had synced, and any other part. As in "All File Systems Are Not Created Equal" (Pillai et al.,
/// OSDI 2014), by POSIX's promises alone: a synced file's name is kept once its folder was synced,
/// too.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/system_calls.hpp"

namespace afterglow::test {

/// The changes below one folder, which the disk has forgotten nothing of before, from its making
/// on.
class LossyDisk : public FileListener {
 public:
  /// The fate of what was not synced.
  enum class Unsynced { Lost, Kept, Random };

  explicit LossyDisk(std::string folder);
  LossyDisk(const LossyDisk&) = delete;
  LossyDisk& operator=(const LossyDisk&) = delete;
  ~LossyDisk() override { listenToFiles(nullptr); }

  void onChange(FileChange change) override;

  std::size_t size() const { return changes_.size(); }
  bool isSync(std::size_t change) const { return changes_[change].kind == FileChange::Kind::Sync; }
  /// Writes what is left when the power goes after the first `count` changes into an empty folder.
  /// Random: any of the writes, each as any of its sectors, and any of the names, but never a later
  /// change of a name without the earlier ones.
  void leave(std::size_t count, Unsynced unsynced, std::uint32_t seed,
             const std::string& folder) const;

 private:
  using Kind = FileChange::Kind;
  struct Change {
    Kind kind;
    std::size_t file = 0;               ///< of Make, Write, Truncate and a file's Sync
    std::string path = {}, other = {};  ///< path: also of a folder's Sync
    std::int64_t offset = 0;
    std::string bytes = {};
  };
  using Id = std::pair<dev_t, ino_t>;
  static constexpr std::size_t kNoFile = ~std::size_t{0};

  std::vector<char> syncedBefore(std::size_t count) const;
  void write(const Change& change, bool is_whole, std::mt19937& random, std::string& bytes) const;
  static bool isOfNames(Kind kind) {
    return kind != Kind::Write && kind != Kind::Truncate && kind != Kind::Sync;
  }

  const std::string folder_;  ///< with a slash at its end
  std::vector<Change> changes_;
  std::map<Id, std::size_t> files_;  ///< numbers of those that are there
  std::size_t file_count_ = 0;
};

}  // namespace afterglow::test
