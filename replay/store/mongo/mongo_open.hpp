/// \file
/// The way to the MongoDB store from where libmongoc may be absent. Internal to replay/store.
#pragma once

#include <memory>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Throws StoreError; also if this program was built without libmongoc.
std::unique_ptr<Store> openMongoStore(const std::string& uri, OpenMode mode);

/// A spool of an earlier version, in which a recorder's writes waited for a server, becomes a store
/// of the same path with all that it held. Where there is none, nothing is done. Goes on where a
/// program that died broke off. Throws as openMongoStore().
void convertSpool(const std::string& path);

}  // namespace afterglow::replay
