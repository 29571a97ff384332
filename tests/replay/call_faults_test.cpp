// Recording and importing while an allocation, a write or a sync fails. All of them fail in turn,
// in half an hour, with AFTERGLOW_TEST_FAULTS=1000000.
#include <gtest/gtest.h>

#include "tests/support/call_faults.hpp"

namespace afterglow::replay::call_faults_test {
namespace {

using namespace afterglow::test;

/// Of a file with 200 messages.
void expectNothingLostByImports(const std::string& name, RecordingFormat format,
                                const std::vector<CallFault>& faults) {
  const TempFolder inputs;
  const std::string file = inputs.path(name);
  scenes::writeRecording(file, format);
  expectNothingLost(
      [&](const std::string& folder, Witness& witness) { scenes::import(file, folder, witness); },
      faults);
}

TEST(CallFaults, ofTheDiskLoseNothingThatTheRecorderHasAcknowledged) {
  expectNothingLost(scenes::record, kOfTheDisk);
}

TEST(CallFaults, ofMemoryLoseNothingThatTheRecorderHasAcknowledged) {
  expectNothingLost(scenes::record, kOfMemory);
}

TEST(CallFaults, ofTheDiskLeaveAnImportWholeOrNotThere) {
  expectNothingLostByImports("x.bag", RecordingFormat::Rosbag, kOfTheDisk);
  expectNothingLostByImports("x.mcap", RecordingFormat::Mcap, kOfTheDisk);
}

TEST(CallFaults, ofMemoryLeaveAnImportWholeOrNotThere) {
  expectNothingLostByImports("x.bag", RecordingFormat::Rosbag, kOfMemory);
  expectNothingLostByImports("x.mcap", RecordingFormat::Mcap, kOfMemory);
}

}  // namespace
}  // namespace afterglow::replay::call_faults_test
