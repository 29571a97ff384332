/// \file
/// Opening a store of whatever kind by its URI.
#pragma once

#include <memory>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// "sqlite:PATH", a plain path, or a MongoDB server's mongodb://... (mongo_store.hpp); empty:
/// $AFTERGLOW_STORE, else ~/.local/share/afterglow/afterglow.db. "@FILE": the first line of that
/// file.
std::unique_ptr<Store> openStore(const std::string& uri, OpenMode mode);

/// A store that lives and dies with the object.
std::unique_ptr<Store> openMemoryStore();

}  // namespace afterglow::replay
