// Stands in for this folder where libmongoc is not installed.
#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/mongo/roslog_import.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kAbsent = "this program was built without MongoDB (libmongoc was not found)";

}  // namespace

std::unique_ptr<Store> openMongoStore(const std::string&, OpenMode) { throw StoreError(kAbsent); }

void convertSpool(const std::string&) { throw StoreError(kAbsent); }

RoslogImportResult importRoslog(const std::string& uri, Store&, const RoslogImport&) {
  throw StoreError(uri + ": this build reads no MongoDB: libmongoc was not found");
}

}  // namespace afterglow::replay
