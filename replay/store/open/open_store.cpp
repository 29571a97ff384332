#include "replay/store/open/open_store.hpp"

#include <cstdlib>
#include <filesystem>

#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"

namespace afterglow::replay {

namespace {

std::unique_ptr<Store> openNamed(const std::string& uri, OpenMode mode) {
  const std::string named = fullStoreUri(uri);
  if (isServerUri(named)) return openMongoStore(named, mode);
  const char* variable = std::getenv("AFTERGLOW_STORE");
  const bool is_default = uri.empty() && (variable == nullptr || *variable == 0);
  if (is_default && mode == OpenMode::ReadOnly && !std::filesystem::exists(storePath(named))) {
    throw StoreError("sqlite:" + storePath(named) +
                     ": no such store; it is the default one, into which nothing was recorded yet; "
                     "--store or AFTERGLOW_STORE names another");
  }
  return std::make_unique<SqliteStore>(storePath(named), mode);
}

/// A text with the file's name for the store that it names.
std::string namingFile(std::string text, const std::string& file) {
  const std::string uri = storeUri(file);
  for (const std::string& named : {uri, isServerUri(uri) ? uri : storePath(file)}) {
    for (std::size_t at = text.find(named); at != std::string::npos; at = text.find(named, at)) {
      text.replace(at, named.size(), file);
      at += file.size();
    }
  }
  return text;
}

}  // namespace

std::unique_ptr<Store> openStore(const std::string& uri, OpenMode mode) {
  const char* variable = std::getenv("AFTERGLOW_STORE");
  const std::string given = uri.empty() && variable != nullptr ? variable : uri;
  if (given.rfind('@', 0) != 0) return openNamed(uri, mode);
  fullStoreUri(given);  // its own refusals name the file
  try {
    return openNamed(uri, mode);
  } catch (const StoreBusy& error) {
    throw StoreBusy(namingFile(error.what(), given));
  } catch (const StoreAway& error) {
    throw StoreAway(namingFile(error.what(), given));
  } catch (const StoreError& error) {
    throw StoreError(namingFile(error.what(), given));
  }
}

std::unique_ptr<Store> openMemoryStore() {
  return std::make_unique<SqliteStore>(":memory:", OpenMode::ReadWrite);
}

}  // namespace afterglow::replay
