#include "replay/store/open/open_store.hpp"

#include <cstdlib>
#include <filesystem>

#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"

namespace afterglow::replay {

std::unique_ptr<Store> openStore(const std::string& uri, OpenMode mode) {
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

std::unique_ptr<Store> openMemoryStore() {
  return std::make_unique<SqliteStore>(":memory:", OpenMode::ReadWrite);
}

}  // namespace afterglow::replay
