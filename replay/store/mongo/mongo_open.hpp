/// \file
/// The way to the MongoDB store from where libmongoc may be absent. Internal to replay/store.
#pragma once

#include <memory>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Throws StoreError; also if this program was built without libmongoc.
std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode);

}  // namespace afterglow::replay
