#include "replay/store/mongo/mongo_open.hpp"

namespace afterglow::replay {

std::unique_ptr<Store> openMongoStore(const std::string&, OpenMode) {
  throw StoreError("this program was built without MongoDB (libmongoc was not found)");
}

}  // namespace afterglow::replay
