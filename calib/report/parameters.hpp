/// \file
/// The projector's parameters with their deviations, and what they mean.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// Adds lens and pose of reportData. Values and deviations are texts with their unit: so many
/// decimals that the deviation has two digits.
void addParameters(const ProjectorEstimate& estimate, nlohmann::ordered_json& data);

}  // namespace afterglow::calib
