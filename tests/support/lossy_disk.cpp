#include "tests/support/lossy_disk.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <filesystem>
#include <optional>
#include <set>

#include "tests/support/temp_folder.hpp"

namespace afterglow::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSector = 512;

std::string parentOf(const std::string& path) { return path.substr(0, path.rfind('/') + 1); }

std::string nameOf(int descriptor) {
  char name[PATH_MAX] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t size = readlink(link.c_str(), name, sizeof name);
  return {name, static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
}

/// As the journal names it: no "." in it, nothing twice.
std::string plain(const std::string& path) {
  return fs::absolute(path).lexically_normal().string();
}

}  // namespace

LossyDisk::LossyDisk(std::string folder) : folder_(plain(folder + "/")) {
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    const std::string path = entry.path().string();
    if (entry.is_directory()) {
      changes_.push_back({Kind::MakeFolder, kNoFile, path});
      continue;
    }
    struct stat status {};
    stat(path.c_str(), &status);
    files_[{status.st_dev, status.st_ino}] = file_count_;
    changes_.push_back({Kind::Make, file_count_, path});
    changes_.push_back({Kind::Write, file_count_, "", "", 0, fileBytes(path)});
    changes_.push_back({Kind::Sync, file_count_++});
  }
  std::set<std::string> parents{folder_};
  for (const Change& change : changes_) parents.insert(parentOf(change.path));
  parents.erase("");
  for (const std::string& parent : parents) changes_.push_back({Kind::Sync, kNoFile, parent});
  listenToFiles(this);
}

void LossyDisk::onChange(FileChange change) {
  Change kept{change.kind,
              kNoFile,
              change.path.empty() ? "" : plain(change.path),
              change.other.empty() ? "" : plain(change.other),
              change.offset,
              std::move(change.bytes)};
  if (change.descriptor >= 0) {
    struct stat status {};
    fstat(change.descriptor, &status);
    const Id id(status.st_dev, status.st_ino);
    if (S_ISDIR(status.st_mode)) {
      kept.path = plain(nameOf(change.descriptor) + "/");
    } else if (change.kind == Kind::Make) {
      files_[id] = file_count_++;
    } else if (files_.count(id) == 0) {
      return;
    }
    if (S_ISREG(status.st_mode)) kept.file = files_[id];
  }
  const bool is_here = kept.path.empty() || kept.path.rfind(folder_, 0) == 0;
  // Shared memory of SQLite's, which it makes anew.
  const std::string& path = kept.path;
  const bool is_memory = path.size() > 4 && path.compare(path.size() - 4, 4, "-shm") == 0;
  if (is_here && !(is_memory && kept.kind == Kind::Make)) {
    changes_.push_back(std::move(kept));
  } else if (kept.kind == Kind::Make) {
    // Of files elsewhere nothing is kept.
    for (auto file = files_.begin(); file != files_.end();) {
      file = file->second == kept.file ? files_.erase(file) : std::next(file);
    }
  }
}

std::vector<char> LossyDisk::syncedBefore(std::size_t count) const {
  std::vector<char> is_synced(count, 0);
  std::set<std::size_t> files;
  std::set<std::string> folders;
  for (std::size_t i = count; i-- > 0;) {
    const Change& change = changes_[i];
    if (change.kind == Kind::Sync) {
      if (change.file != kNoFile) files.insert(change.file);
      if (change.file == kNoFile) folders.insert(change.path);
    } else if (isOfNames(change.kind)) {
      is_synced[i] = folders.count(parentOf(change.path)) != 0 &&
                     (change.other.empty() || folders.count(parentOf(change.other)) != 0);
    } else {
      is_synced[i] = files.count(change.file) != 0;
    }
  }
  return is_synced;
}

void LossyDisk::write(const Change& change, bool is_whole, std::mt19937& random,
                      std::string& bytes) const {
  const auto begin = static_cast<std::size_t>(change.offset);
  if (change.kind == Kind::Truncate) return bytes.resize(begin);
  bytes.resize(std::max(bytes.size(), begin + change.bytes.size()));
  for (std::size_t at = 0; at < change.bytes.size();) {
    const std::size_t size = std::min(kSector - (begin + at) % kSector, change.bytes.size() - at);
    if (is_whole || random() % 2 == 0) bytes.replace(begin + at, size, change.bytes, at, size);
    at += size;
  }
}

void LossyDisk::leave(std::size_t count, Unsynced unsynced, std::uint32_t seed,
                      const std::string& folder) const {
  std::mt19937 random(seed);
  const std::vector<char> is_synced = syncedBefore(count);
  const std::size_t last_name = unsynced == Unsynced::Random ? random() % (count + 1)
                                : unsynced == Unsynced::Kept ? count
                                                             : 0;
  std::map<std::string, std::size_t> names;
  std::set<std::string> folders{folder_};
  std::map<std::size_t, std::string> contents;
  for (std::size_t i = 0; i < count; ++i) {
    const Change& change = changes_[i];
    if (isOfNames(change.kind)) {
      if (!is_synced[i] && i >= last_name) continue;
      const auto named = names.find(change.path);
      if (change.kind == Kind::Make) names[change.path] = change.file;
      if (change.kind == Kind::MakeFolder) folders.insert(change.path + "/");
      if (change.kind == Kind::RemoveFolder) folders.erase(change.path + "/");
      if (named == names.end()) continue;
      if (change.kind == Kind::Rename || change.kind == Kind::Link) {
        names[change.other] = named->second;
      }
      if (change.kind == Kind::Rename || change.kind == Kind::Remove) names.erase(change.path);
      continue;
    }
    if (change.kind == Kind::Sync) continue;
    const bool is_whole = is_synced[i] || unsynced == Unsynced::Kept;
    const bool is_lost = !is_whole && (unsynced == Unsynced::Lost || random() % 2 == 0);
    if (!is_lost) write(change, is_whole, random, contents[change.file]);
  }
  for (const std::string& kept : folders)
    fs::create_directories(folder + "/" + kept.substr(folder_.size()));
  for (const auto& [name, file] : names) {
    if (folders.count(parentOf(name)) == 0) continue;  // its folder's name is lost
    writeFile(folder + "/" + name.substr(folder_.size()), contents[file]);
  }
}

}  // namespace afterglow::test
