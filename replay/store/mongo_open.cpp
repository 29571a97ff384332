#include "replay/store/mongo_open.hpp"

#include "replay/store/mongo_store.hpp"

namespace afterglow::replay {

std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode) {
  return std::make_unique<MongoStore>(uri, mode);
}

}  // namespace afterglow::replay
