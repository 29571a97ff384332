/// \file
/// A context for a test, or the reason why it cannot run here.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <stdexcept>

#include "render/projector_renderer.hpp"

namespace afterglow::test {

/// Skips its tests where there is no OpenGL; with AFTERGLOW_REQUIRE_GL set they fail instead.
class GlTest : public ::testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<render::GlContext>();
      context_->makeCurrent();
    } catch (const std::runtime_error& error) {
      if (std::getenv("AFTERGLOW_REQUIRE_GL")) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
  }
  render::GlContext& context() { return *context_; }

 private:
  std::unique_ptr<render::GlContext> context_;
};

}  // namespace afterglow::test
