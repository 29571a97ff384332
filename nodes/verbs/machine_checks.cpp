#include "nodes/verbs/machine_checks.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <pwd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>

#include "nodes/player/realtime.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/program.hpp"
#include "render/gl/gl_context.hpp"
#include "render/gl/window.hpp"
#include "replay/record/disk_guard.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/open/recorder_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kPacketBytes = 48;
constexpr std::size_t kReceivedAt = 32, kSentAt = 40, kOriginAt = 24, kOurTimeAt = 40;
constexpr std::int64_t kUnixEpochIn1900 = 2'208'988'800;  // s
constexpr int kQuestions = 4;

using Packet = std::array<std::uint8_t, kPacketBytes>;
using Addresses = std::unique_ptr<addrinfo, void (*)(addrinfo*)>;

Addresses addressesOf(const std::string& host, std::uint16_t port) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found) != 0) {
    found = nullptr;
  }
  return {found, [](addrinfo* list) {
            if (list) ::freeaddrinfo(list);
          }};
}

class Socket {
 public:
  explicit Socket(const addrinfo& address)
      : fd_(::socket(address.ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  int fd() const { return fd_; }

 private:
  const int fd_;
};

std::int64_t wallNs() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Seconds since 1900 and their 2^32th parts, big endian.
void writeTime(Packet& packet, std::size_t at, std::int64_t ns) {
  const auto seconds = static_cast<std::uint64_t>(ns / 1'000'000'000 + kUnixEpochIn1900);
  const auto rest = static_cast<std::uint64_t>(ns % 1'000'000'000);
  const std::uint64_t time = (seconds << 32U) | ((rest << 32U) / 1'000'000'000U);
  for (std::size_t i = 0; i < 8; ++i) {
    packet[at + i] = static_cast<std::uint8_t>(time >> (56 - 8 * i));
  }
}

std::int64_t readTime(const Packet& packet, std::size_t at) {
  std::uint64_t time = 0;
  for (std::size_t i = 0; i < 8; ++i) time = (time << 8U) | packet[at + i];
  const auto seconds = static_cast<std::int64_t>(time >> 32U) - kUnixEpochIn1900;
  const std::uint64_t parts = time & 0xffffffffU;
  return seconds * 1'000'000'000 + static_cast<std::int64_t>((parts * 1'000'000'000U) >> 32U);
}

/// A server's answer to our question, by a clock that is set.
bool isAnswer(const Packet& answer, const Packet& question) {
  const unsigned leap = answer[0] >> 6U, mode = answer[0] & 7U, stratum = answer[1];
  return leap != 3 && mode == 4 && stratum >= 1 && stratum <= 15 &&
         std::equal(question.begin() + kOurTimeAt, question.end(), answer.begin() + kOriginAt);
}

std::optional<ClockOffset> ask(int fd, double seconds) {
  Packet question{};
  question[0] = (4U << 3U) | 3U;  // version 4, client
  const std::int64_t asked = wallNs();
  writeTime(question, kOurTimeAt, asked);
  if (::send(fd, question.data(), question.size(), 0) < 0) return std::nullopt;
  pollfd waiting{fd, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(std::lround(seconds * 1000))) <= 0) return std::nullopt;
  Packet answer{};
  const ssize_t count = ::recv(fd, answer.data(), answer.size(), 0);
  const std::int64_t heard = wallNs();
  if (count < static_cast<ssize_t>(answer.size()) || !isAnswer(answer, question)) {
    return std::nullopt;
  }
  const std::int64_t received = readTime(answer, kReceivedAt), sent = readTime(answer, kSentAt);
  const std::int64_t round_trip = (heard - asked) - (sent - received);
  return ClockOffset{((received - asked) + (sent - heard)) / 2,
                     std::max<std::int64_t>(0, round_trip / 2)};
}

}  // namespace

std::optional<ClockOffset> askTimeServer(const std::string& host, double seconds,
                                         std::uint16_t port) {
  const Addresses addresses = addressesOf(host, port);
  if (!addresses) return std::nullopt;
  const Socket socket(*addresses);
  if (::connect(socket.fd(), addresses->ai_addr, addresses->ai_addrlen) != 0) return std::nullopt;
  std::optional<ClockOffset> best;
  for (int i = 0; i < kQuestions; ++i) {
    const auto offset = ask(socket.fd(), seconds / kQuestions);
    if (offset && (!best || offset->at_most_ns < best->at_most_ns)) best = offset;
  }
  return best;
}

bool isThisMachine(const std::string& host) {
  const Addresses addresses = addressesOf(host, 0);
  for (const addrinfo* address = addresses.get(); address; address = address->ai_next) {
    const Socket socket(*address);
    if (::bind(socket.fd(), address->ai_addr, address->ai_addrlen) == 0) return true;
  }
  return false;
}

namespace {

constexpr double kDriverPatience = 10, kProgramPatience = 3, kStorePatience = 2;  // s
constexpr double kTimeServerPatience = 1;                                         // s
constexpr std::uint64_t kMinSpace = std::uint64_t{1} << 30;  // as of recorder_node's ~min_space
constexpr double kOffsetMs = 20;  // from there on light and words of two machines are apart

/// Checks by a process of its own; what it throws is for `failed`.
Checkup inProcess(double seconds, const std::function<Checkup()>& check,
                  const std::function<Checkup(const std::string& why)>& failed) {
  try {
    const auto json = nlohmann::json::parse(boundedWork(seconds, [&] {
      const Checkup finding = check();
      return nlohmann::json{static_cast<int>(finding.level), finding.name, finding.found,
                            finding.advice}
          .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    }));
    return {json[1].get<std::string>(), static_cast<Checkup::Level>(json[0].get<int>()),
            json[2].get<std::string>(), json[3].get<std::string>()};
  } catch (const std::exception& error) {
    return failed(error.what());
  }
}

std::string userName() {
  const passwd* user = ::getpwuid(::getuid());
  return user ? user->pw_name : std::to_string(::getuid());
}

/// The folder on this disk that a store grows in; empty if it is on a server.
std::string folderOf(const std::string& uri) {
  const std::string full = replay::fullStoreUri(uri);
  return replay::isServerUri(full)
             ? std::string()
             : std::filesystem::path(replay::storePath(full)).parent_path().string();
}

std::string monitorText(const render::Monitor& monitor) {
  return fmt::format("{}{} {}x{}{:+}{:+}", monitor.name,
                     monitor.model.empty() ? "" : " '" + monitor.model + "'", monitor.width,
                     monitor.height, monitor.x, monitor.y);
}

}  // namespace

// ----------------------------------------------------------------------------------------- drawing

Checkup judgeRenderer(const std::string& description) {
  if (render::isSoftware(description)) {
    return Checkup::advise("gpu", "none: OpenGL is drawn by software (" + description + ")",
                           "nothing needs one, the CPU draws the projection; for large clouds "
                           "install a GPU's own driver and add yourself to the groups video, "
                           "render");
  }
  return Checkup::ok("gpu", "OpenGL " + description + ", by EGL without a display");
}

Checkup checkGpu() {
  return inProcess(
      kDriverPatience,
      [] {
        render::GlContext context;
        return judgeRenderer(context.description());
      },
      [](const std::string& why) {
        // A build without OpenGL says itself what is to be done.
        const bool is_without = why.find("AFTERGLOW_WITH_GL") != std::string::npos;
        return Checkup::advise("gpu", why,
                               "the CPU draws the projection; `afterglow render --view observer` " +
                                   std::string(is_without ? "and windows need another build"
                                                          : "needs Mesa (libegl1, libgl1-mesa-dri)"
                                                            " or a GPU's driver"));
      });
}

ConfigurationCheck checkConfiguration(const std::string& config, const std::string& calibration) {
  ConfigurationCheck check;
  try {
    const ProjectorConfig loaded = loadProjectorConfig(config, calibration);
    for (const OutputConfig& projector : loaded.projectors) {
      const calib::Lens lens = loadLens(projector).lens;
      check.wanted.push_back({projector.name, projector.monitor, lens.width, lens.height});
    }
    check.finding = Checkup::ok("configuration", config + " and its lenses can be read");
  } catch (const std::exception& error) {
    check.finding = Checkup::problem("configuration", error.what(),
                                     "mend the file; assets/projector.yaml explains every key");
  }
  return check;
}

Checkup judgeMonitors(const std::vector<render::Monitor>& monitors,
                      const std::vector<WantedMonitor>& wanted) {
  std::vector<std::string> texts;
  for (const render::Monitor& monitor : monitors) texts.push_back(monitorText(monitor));
  const std::string all = texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, ", "));
  for (const WantedMonitor& one : wanted) {
    const std::string problem =
        render::chooseMonitor(monitors, one.monitor, one.width, one.height).problem;
    if (problem.empty()) continue;
    return Checkup::problem("monitors", all,
                            (one.projector.empty() ? "" : one.projector + ": ") + problem);
  }
  if (wanted.empty() && monitors.size() < 2) {
    return Checkup::advise("monitors", all,
                           "no projector beside the screen: connect it as a second one that "
                           "extends the desktop (if this is the projector, all is well)");
  }
  return Checkup::ok("monitors", all);
}

Checkup checkMonitors(const std::vector<WantedMonitor>& wanted) {
  if (!render::hasDisplay()) {
    return Checkup::advise("monitors", "no display (DISPLAY is not set)",
                           "on the machine with the projector export DISPLAY=:0; without, "
                           "projector_node only publishes its picture");
  }
  return inProcess(
      kDriverPatience, [&] { return judgeMonitors(render::Window::monitors(), wanted); },
      [](const std::string& why) {
        return Checkup::problem("monitors", why,
                                "let this user use the display: xhost +si:localuser:" + userName());
      });
}

// ------------------------------------------------------------------------------------ time, sound

Checkup checkRealtime() {
  return inProcess(
      kProgramPatience,
      [] {
        const RealtimeScope scope;
        rlimit limit{};
        ::getrlimit(RLIMIT_RTPRIO, &limit);
        const std::string found = fmt::format("{} (rtprio limit {})", scope.description(),
                                              static_cast<std::uint64_t>(limit.rlim_cur));
        if (scope.description() == "SCHED_FIFO") return Checkup::ok("real time", found);
        return Checkup::advise(
            "real time", found,
            "a replay is later on a busy machine; grant it: echo '" + userName() +
                " - rtprio 20' | sudo tee /etc/security/limits.d/afterglow.conf, log in anew");
      },
      [](const std::string& why) { return Checkup::advise("real time", why, "see ulimit -r"); });
}

Checkup checkOwnClock() {
  timex state{};
  const int status = ::adjtimex(&state);
  if (status < 0) return Checkup::advise("clock", "the kernel does not say", "run chrony");
  if (status == TIME_ERROR || (state.status & STA_UNSYNC) != 0) {
    return Checkup::advise("clock", "not set by any time server, as the kernel says",
                           "apt install chrony on robot and computers, each with the robot as its "
                           "server: stamps of two machines are compared");
  }
  return Checkup::ok("clock", fmt::format("set by a time server; estimated error {:.3f} ms",
                                          static_cast<double>(state.esterror) * 1e-3));
}

Checkup checkRobotClock(const std::string& host) {
  if (isThisMachine(host)) return Checkup::ok("robot's clock", "the master is on this machine");
  const auto offset = askTimeServer(host, kTimeServerPatience);
  if (!offset) {
    return Checkup::advise("robot's clock", "not measured: " + host + " answers no NTP question",
                           "run chrony there, with `allow` for this network, and let this machine "
                           "follow it");
  }
  const double ahead_ms = static_cast<double>(offset->ahead_ns) * 1e-6;
  const std::string found =
      fmt::format("{:.1f} ms {} ours, within {:.1f} ms (NTP, {})", std::abs(ahead_ms),
                  ahead_ms < 0 ? "behind" : "ahead of",
                  static_cast<double>(offset->at_most_ns) * 1e-6, host);
  if (std::abs(ahead_ms) < kOffsetMs) return Checkup::ok("robot's clock", found);
  return Checkup::advise("robot's clock", found,
                         "let this machine follow it: server " + host +
                             " iburst in chrony's configuration");
}

Checkup checkSound() {
  const char* const name = "sound";
  const bool has_aplay = hasProgram("aplay");
  if (!has_aplay && !hasProgram("paplay")) {
    return Checkup::advise(name, "neither aplay nor paplay is installed",
                           "apt install alsa-utils, or speech is silent");
  }
  const std::vector<std::string> question =
      has_aplay ? std::vector<std::string>{"aplay", "-l"}
                : std::vector<std::string>{"pactl", "list", "short", "sinks"};
  return inProcess(
      kProgramPatience,
      [&] {
        const ProgramResult result = runProgram(question);
        if (result.status == 0 && !result.output.empty()) {
          return Checkup::ok(name, question.front() + " lists a device (nothing was played)");
        }
        return Checkup::advise(name, question.front() + " lists no device",
                               "connect a loudspeaker and add yourself to the group audio");
      },
      [&](const std::string& why) {
        return Checkup::advise(name, question.front() + ": " + why, "try it in a terminal");
      });
}

// ------------------------------------------------------------------------------------------ stores

Checkup checkStore(const std::string& uri) {
  const char* const name = "store";
  try {
    const std::string shown = replay::storeUri(uri), folder = folderOf(uri);
    const std::string full = replay::fullStoreUri(uri);
    std::error_code ignored;
    if (!replay::isServerUri(full) && !std::filesystem::exists(replay::storePath(full), ignored)) {
      return Checkup::ok(name, shown + ": not there yet; the first recording makes it");
    }
    return inProcess(
        kStorePatience,
        [&] {
          const auto store = replay::openStore(uri, replay::OpenMode::ReadOnly);
          replay::BehaviorFilter newest;
          newest.limit = 1;
          const auto found = store->behaviors(newest);
          return Checkup::ok(name, shown + (found.empty() ? ": it opens, and is empty"
                                                          : ": it opens; newest: " +
                                                                std::to_string(found[0].id) +
                                                                " '" + found[0].name + "'"));
        },
        [&](const std::string& why) {
          const std::string found = why.rfind(shown, 0) == 0 ? why : shown + ": " + why;
          return Checkup::problem(name, found,
                                  folder.empty() ? "start the server, or name another store"
                                                 : "afterglow store check; or name another store");
        });
  } catch (const std::exception& error) {
    return Checkup::problem(name, error.what(), "name another store: --store, AFTERGLOW_STORE");
  }
}

Checkup checkDisk(const std::string& uri) {
  const char* const name = "disk";
  const char* const advice = "make room: afterglow store prune, ~retention_days of recorder_node";
  try {
    const std::string full = replay::fullStoreUri(uri);
    const std::string folder =
        replay::isServerUri(full)
            ? std::filesystem::path(replay::recorderFile(full)).parent_path().string()
            : folderOf(uri);
    const std::string shown = folder.empty() ? "." : folder;
    const auto free = replay::freeBytes(shown);
    if (!free) return Checkup::advise(name, "the system does not say what is free", "see df");
    const replay::DiskState state = replay::judgeDisk(shown, *free, kMinSpace);
    if (state.level == replay::DiskState::Level::Full) {
      return Checkup::problem(name, state.text, advice);
    }
    if (state.level == replay::DiskState::Level::Low) {
      return Checkup::advise(name, state.text, advice);
    }
    return Checkup::ok(name, fmt::format("{:.1f} GB are free below {}",
                                         static_cast<double>(*free) * 1e-9, shown));
  } catch (const std::exception& error) {
    return Checkup::problem(name, error.what(), advice);
  }
}

}  // namespace afterglow::nodes
