/// \file
/// The permissions of a store and its locks. What a robot saw and said in somebody's home is
/// its owner's: files are made 0600 and folders 0700, whatever the umask. $AFTERGLOW_STORE_ACCESS
/// asks otherwise: "group" gives 0660 and 0770, "all" 0664 and 0775. What is there keeps its mode.
#pragma once

#include <string>

namespace afterglow::replay {

/// Makes a folder and those above it that are missing; an empty name is the current folder. Throws
/// StoreError.
void makePrivateFolder(const std::string& folder);

/// The file that a path leads to through symbolic links, also where it is not there yet; the path
/// itself if it is no link.
std::string realFile(const std::string& path);

/// Makes an empty file, with the mode of the file `like`, if that is there. A descriptor of it, for
/// reading and writing; -1, with errno, if it cannot be made or is there already: a file that
/// SQLite has open must not be opened beside it, as closing that would end its locks.
int makePrivateFile(const std::string& path, const std::string& like = "");

}  // namespace afterglow::replay
