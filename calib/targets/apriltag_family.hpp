/// \file
/// libapriltag's own description of a family, for those who call that library.
#pragma once

#include <memory>
#include <string>

extern "C" struct apriltag_family;

namespace afterglow::calib {

using FamilyHandle = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// Throws std::invalid_argument naming the families there are.
FamilyHandle makeFamily(const std::string& family);

}  // namespace afterglow::calib
