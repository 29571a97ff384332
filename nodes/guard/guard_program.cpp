#include "nodes/guard/guard_program.hpp"

#include <sched.h>
#include <signal.h>

#include "nodes/tools/stop_signal.hpp"

namespace afterglow {
namespace nodes {

void beginGuard() {
  sched_param parameters = {};
  parameters.sched_priority = 20;
  sched_setscheduler(0, SCHED_FIFO, &parameters);  // for all threads of this process
  ::signal(SIGPIPE, SIG_IGN);
  catchStopSignals(SecondSignal::IsIgnored);  // however often it is told to end
  catchShutdownRequests();
}

}  // namespace nodes
}  // namespace afterglow
