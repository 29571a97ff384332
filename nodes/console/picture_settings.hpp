/// \file
/// What verbs and console_node are told about pictures.
#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <string>

#include "nodes/console/picture_desk.hpp"

namespace afterglow::nodes {

struct PictureOptions {
  std::string config, calibration, projector;
};

/// --config, --calibration, --projector.
void addPictureOptions(CLI::App& verb, PictureOptions& options);

/// Null where no projector is configured. Throws std::runtime_error for a configuration that cannot
/// be used, and replay::StoreError.
std::unique_ptr<PictureDesk> openDesk(const replay::Store& store, const PictureOptions& options,
                                      const ObserverOptions& observer = {});

}  // namespace afterglow::nodes
