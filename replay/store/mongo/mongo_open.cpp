#include "replay/store/mongo/mongo_open.hpp"

#include "replay/store/mongo/mongo_store.hpp"
#include "replay/store/mongo/spooled_store.hpp"

namespace afterglow::replay {

std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode) {
  if (mode == OpenMode::Record) return std::make_unique<SpooledStore>(uri, SpoolOptions{});
  return std::make_unique<MongoStore>(uri, mode);
}

}  // namespace afterglow::replay
