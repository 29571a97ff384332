#include "replay/store/open/open_store.hpp"

#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"

namespace afterglow::replay {

std::unique_ptr<Store> openStore(const std::string& uri, OpenMode mode) {
  const std::string named = fullStoreUri(uri);
  if (isServerUri(named)) return openMongoStore(named, mode);
  return std::make_unique<SqliteStore>(storePath(named), mode);
}

std::unique_ptr<Store> openMemoryStore() {
  return std::make_unique<SqliteStore>(":memory:", OpenMode::ReadWrite);
}

}  // namespace afterglow::replay
