// Stands in for roslog_import.cpp where libmongoc is not installed.
#include "replay/store/mongo/roslog_import.hpp"

namespace afterglow::replay {

RoslogImportResult importRoslog(const std::string& uri, Store&, const RoslogImport&) {
  throw StoreError(uri + ": this build reads no MongoDB: libmongoc was not found");
}

}  // namespace afterglow::replay
