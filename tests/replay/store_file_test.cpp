// What becomes of files: those that are no stores, full disks, killed writers.
#include <gtest/gtest.h>
#include <pwd.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/sqlite/store_care.hpp"
#include "replay/store/store.hpp"
#include "tests/support/faulty_disk.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::store_file_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;

std::string openError(const std::string& uri, OpenMode mode) {
  try {
    openStore(uri, mode);
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

void runSql(const std::string& path, const std::string& sql) {
  sqlite3* connection = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &connection), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(connection, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(connection);
}

/// Opening is refused with this text either way, and the folder is left as it was.
void expectRefused(const TempFolder& folder, const std::string& name, const std::string& why) {
  const std::string path = folder.path(name);
  const auto files = [&] {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(folder.path(""))) {
      all[entry.path().filename()] = entry.is_directory() ? "" : fileBytes(entry.path());
    }
    return all;
  };
  const auto before = files();
  for (const OpenMode mode : {OpenMode::ReadOnly, OpenMode::ReadWrite}) {
    EXPECT_EQ(openError(path, mode), "sqlite:" + path + ": " + why);
  }
  EXPECT_EQ(files(), before);
}

TEST(StoreFile, refusesWhatIsNoDatabase) {
  const TempFolder folder;
  writeFile(folder.path("notes.txt"), std::string(5000, 'x'));
  expectRefused(folder, "notes.txt", "not an Afterglow store: the file is no SQLite database");
  writeFile(folder.path("short"), "SQLite format 3");
  expectRefused(folder, "short", "not an Afterglow store: the file is no SQLite database");
  fs::create_directory(folder.path("folder"));
  expectRefused(folder, "folder", "not an Afterglow store: it is a folder");
}

TEST(StoreFile, refusesAnotherProgramsDatabase) {
  const TempFolder folder;
  runSql(folder.path("other.db"), "PRAGMA journal_mode = WAL; CREATE TABLE mine (x);");
  expectRefused(folder, "other.db",
                "not an Afterglow store: the file is another program's SQLite database");
}

TEST(StoreFile, refusesANewerVersion) {
  const TempFolder folder;
  openStore(folder.path("store.db"), OpenMode::ReadWrite);
  runSql(folder.path("store.db"), "PRAGMA user_version = 4;");
  expectRefused(folder, "store.db", "the store has version 4, this program knows up to 3");
}

TEST(StoreFile, readsOneOfVersion2AndTakesItsIndexOutWhenItWrites) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  openStore(path, OpenMode::ReadWrite)->addRecording({0, "", "x", ""});
  runSql(path, "CREATE TABLE field_blocks (channel INTEGER); PRAGMA user_version = 2;");
  EXPECT_EQ(openStore(path, OpenMode::ReadOnly)->recordings().size(), 1u);
  EXPECT_EQ(openStore(path, OpenMode::ReadWrite)->recordings().size(), 1u);
  SqliteConnection connection(path, SqliteAccess::ReadOnly);
  EXPECT_EQ(connection.integer("PRAGMA user_version"), 3);
  EXPECT_EQ(connection.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'field_blocks'"),
            0);
}

TEST(StoreFile, refusesToReadWhatIsNotThere) {
  const TempFolder folder;
  const std::string path = folder.path("none.db");
  EXPECT_EQ(openError(path, OpenMode::ReadOnly), "sqlite:" + path + ": no such store");
  EXPECT_FALSE(fs::exists(path));
  writeFile(folder.path("empty.db"), "");
  EXPECT_NE(openError(folder.path("empty.db"), OpenMode::ReadOnly), "");
}

TEST(StoreFile, isMadeAnewWhenThePowerWentAsItWasMade) {
  const TempFolder folder;
  const std::string path = folder.path("store.db"), journal = path + "-journal";
  {
    SqliteConnection connection(path, SqliteAccess::ReadWriteCreate);
    connection.execute("PRAGMA cache_spill = 1; BEGIN; CREATE TABLE x (y);");
    // The journal is hot: the cache, of two pages, has gone to the file before the end.
    connection.execute(
        "PRAGMA cache_size = 2; INSERT INTO x SELECT zeroblob(9000) FROM "
        "(VALUES (1), (2), (3), (4));");
    fs::copy_file(journal, folder.path("copy-journal"));
  }
  fs::rename(folder.path("copy-journal"), journal);
  writeFile(path, std::string(32768, '\0'));  // the first sector is among what was lost
  EXPECT_EQ(openError(path, OpenMode::ReadOnly),
            "sqlite:" + path +
                ": not an Afterglow store: the power went, or its program, as it was made");
  EXPECT_EQ(openError(path, OpenMode::Record), "");
  EXPECT_EQ(openError(path, OpenMode::ReadOnly), "");
}

TEST(StoreFile, saysWhereItCannotBeMade) {
  EXPECT_NE(openError("/proc/store.db", OpenMode::ReadWrite).find("sqlite:/proc/store.db: cannot"),
            std::string::npos);
  EXPECT_NE(
      openError("/proc/version/x/store.db", OpenMode::ReadWrite).find("cannot make the folder"),
      std::string::npos);
}

TEST(StoreFile, isMadeWithItsFolders) {
  const TempFolder folder;
  const std::string path = folder.path("a/b/store.db");
  openStore("sqlite:" + path, OpenMode::ReadWrite)->addRecording({0, "", "x", ""});
  EXPECT_EQ(openError(path, OpenMode::ReadOnly), "");
  SqliteConnection connection(path, SqliteAccess::ReadOnly);
  EXPECT_EQ(connection.integer("PRAGMA application_id"), 0x4167776c);
  EXPECT_EQ(connection.integer("PRAGMA user_version"), 3);
}

TEST(StoreFile, isNamedByUriOrPathOrEnvironment) {
  EXPECT_EQ(storeUri("sqlite:/x/y.db"), "sqlite:/x/y.db");
  EXPECT_EQ(storeUri("y.db"), "sqlite:y.db");
  EXPECT_EQ(storePath("sqlite:y.db"), "y.db");
  setenv("AFTERGLOW_STORE", "sqlite:/from/environment.db", 1);
  EXPECT_EQ(storePath(""), "/from/environment.db");
  unsetenv("AFTERGLOW_STORE");
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(storePath(""), "/home/somebody/.local/share/afterglow/afterglow.db");
  EXPECT_EQ(
      openError("mongo://host/roslog", OpenMode::ReadOnly),
      "mongo://host/roslog: there is no store of the kind \"mongo\"; a store is sqlite:PATH or "
      "mongodb://...");
}

/// As of a program that systemd starts.
TEST(StoreFile, liesInTheAccountsFolderWhereHomeIsNotSet) {
  const passwd* account = getpwuid(geteuid());
  if (account == nullptr) GTEST_SKIP() << "this user has no account";
  for (const char* home : {"", static_cast<const char*>(nullptr)}) {
    home ? setenv("HOME", home, 1) : unsetenv("HOME");
    EXPECT_EQ(storePath(""), account->pw_dir + std::string("/.local/share/afterglow/afterglow.db"));
  }
  setenv("HOME", "/home/somebody", 1);
}

TEST(StoreFile, isRefusedWhereAUriNamesNone) {
  EXPECT_EQ(openError("sqlite:", OpenMode::ReadWrite), "sqlite: names no file");
  EXPECT_THROW(storePath("mongodb://host/roslog"), StoreError);
  setenv("AFTERGLOW_STORE", "", 1);
  const TempFolder folder;
  setenv("HOME", folder.path("").c_str(), 1);
  const std::string error = openError("", OpenMode::ReadOnly);
  EXPECT_NE(error.find("no such store; it is the default one"), std::string::npos) << error;
  unsetenv("AFTERGLOW_STORE");
  setenv("HOME", "/home/somebody", 1);
}

/// Of which SQLite makes URIs.
TEST(StoreFile, mayHaveAnyName) {
  const TempFolder folder;
  for (const char* name : {"50% off.db", "what?.db", "no #1.db", "a%20b.db", "mode=ro&x.db"}) {
    openStore(folder.path(name), OpenMode::Record)->addRecording({0, "", name, ""});
    EXPECT_EQ(openStore(folder.path(name), OpenMode::ReadOnly)->recordings().at(0).source, name);
    EXPECT_TRUE(fs::exists(folder.path(name)));
  }
}

TEST(StoreFile, isNoPipe) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  for (const OpenMode mode : {OpenMode::ReadOnly, OpenMode::Record}) {
    EXPECT_EQ(openError(folder.path("pipe"), mode),
              "sqlite:" + folder.path("pipe") + ": not an Afterglow store: it is no regular file");
  }
}

TEST(StoreFile, saysWhyItCannotBeLocked) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  fs::create_directory(path + ".lock");
  EXPECT_EQ(openError(path, OpenMode::Record),
            "sqlite:" + path + ": cannot make " + path + ".lock: Is a directory");
  fs::create_directory(path + ".imports");
  EXPECT_THROW(openStore(path, OpenMode::ReadWrite)->beginImport({0, "", "a.bag", ""}), StoreError);
}

TEST(StoreFile, isRecordedIntoByAnotherAlsoWhereNobodySaysByWhom) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  const auto recorder = openStore(path, OpenMode::Record);
  fs::resize_file(path + ".lock", 0);
  EXPECT_EQ(openError(path, OpenMode::Record),
            "sqlite:" + path + ": cannot record: another process records into it");
}

TEST(StoreFile, growsInItsFolder) {
  const TempFolder folder;
  EXPECT_EQ(openStore(folder.path("store.db"), OpenMode::ReadWrite)->folder() + "/",
            folder.path(""));
  const auto in_memory = openMemoryStore();
  EXPECT_EQ(in_memory->folder(), "");
  in_memory->compact();
  EXPECT_EQ(in_memory->dropUnfinished(), 0u);
}

TEST(StoreFile, isNamedByAFileThatKeepsAPassword) {
  const TempFolder folder;
  writeFile(folder.path("uri"), "mongodb://robot:geh@eim@host/fleet?tls=true\r\nmore\n");
  EXPECT_EQ(fullStoreUri("@" + folder.path("uri")), "mongodb://robot:geh@eim@host/fleet?tls=true");
  setenv("AFTERGLOW_STORE", ("@" + folder.path("uri")).c_str(), 1);
  EXPECT_EQ(storeUri(""), "mongodb://host/fleet");
  unsetenv("AFTERGLOW_STORE");
  EXPECT_NE(openError("@" + folder.path("none"), OpenMode::ReadOnly).find("cannot be read"),
            std::string::npos);
}

TEST(StoreFile, printsNothingOfAFileThatIsToNameIt) {
  const TempFolder folder;
  const std::string file = folder.path("secrets"), given = "@" + file;
  for (const std::string& line : {std::string("root:x:0:0:root:/root:/bin/bash"),
                                  std::string("token=verysecret"), std::string("verysecret.db"),
                                  std::string(1 << 20, 's'), std::string("ftp://verysecret/x")}) {
    writeFile(file, line + "\n");
    for (const OpenMode mode : {OpenMode::ReadOnly, OpenMode::Record}) {
      EXPECT_EQ(openError(given, mode),
                "no store: the first line of " + file + " is none; it has to be sqlite:PATH, a path "
                "that begins with /, or mongodb://...");
    }
  }
  writeFile(file, "/verysecret/store.db\n");
  EXPECT_EQ(openError(given, OpenMode::ReadOnly), given + ": no such store");
  writeFile(file, "sqlite:" + folder.path("verysecret.db"));
  EXPECT_EQ(openError(given, OpenMode::ReadOnly), given + ": no such store");
  ASSERT_EQ(mkfifo(folder.path("pipe").c_str(), 0600), 0);
  EXPECT_NE(openError("@" + folder.path("pipe"), OpenMode::ReadOnly).find("cannot be read"),
            std::string::npos) << "and is not waited for";
}

TEST(StoreFile, isOneStoreByWhateverLinksLeadToIt) {
  const TempFolder folder;
  const std::string real = folder.path("real.db"), link = folder.path("link.db");
  fs::create_symlink("real.db", link);
  fs::create_symlink("link.db", folder.path("further.db"));
  const auto first = openStore(folder.path("further.db"), OpenMode::Record);
  EXPECT_EQ(fs::status(real).permissions(), fs::perms::owner_read | fs::perms::owner_write)
      << "made by a link that led to nothing";
  for (const std::string& path : {real, link, folder.path("further.db")}) {
    EXPECT_NE(openError(path, OpenMode::Record).find("records into it"), std::string::npos) << path;
  }
}

TEST(StoreFile, isNotWrittenByTwoNamesOfOneFile) {
  const TempFolder folder;
  openStore(folder.path("one.db"), OpenMode::ReadWrite);
  fs::create_hard_link(folder.path("one.db"), folder.path("other.db"));
  EXPECT_NE(openError(folder.path("other.db"), OpenMode::Record)
                .find("the file has 2 names (hard links), and SQLite a log for each"),
            std::string::npos);
  EXPECT_EQ(openError(folder.path("other.db"), OpenMode::ReadOnly), "");
}

/// A user's rights, in a process of its own; root has all of them.
std::string errorOfNobody(const std::string& path, OpenMode mode) {
  int channel[2];
  if (pipe(channel) != 0) return "no pipe";
  const pid_t child = fork();
  if (child == 0) {
    std::string said = "no user";
    if (setresuid(65534, 65534, 65534) == 0) said = openError(path, mode);
    const auto written = write(channel[1], said.data(), said.size());
    _exit(written < 0 ? 1 : 0);
  }
  close(channel[1]);
  std::string text(4096, '\0');
  const auto size = read(channel[0], text.data(), text.size());
  close(channel[0]);
  waitpid(child, nullptr, 0);
  return text.substr(0, static_cast<std::size_t>(std::max<ssize_t>(0, size)));
}

TEST(StoreFile, saysWhichFileOrFolderItMayNotUse) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to become another user";
  const TempFolder folder;
  const std::string path = folder.path("store.db"), root = fs::path(path).parent_path().string();
  openStore(path, OpenMode::ReadWrite);
  fs::permissions(root, fs::perms(0755));
  fs::permissions(path, fs::perms(0644));
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadOnly), "") << "nothing has to be written";
  const std::string cannot = "sqlite:" + path + ": cannot open the store: ";
  const std::string needs = "its folder " + root + ", where SQLite has to keep files beside it, is "
                            "not to be written: Permission denied";
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadWrite),
            cannot + "the file is not to be written: Permission denied");
  fs::permissions(path, fs::perms(0666));
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadWrite), cannot + needs);
  writeFile(path + "-wal", "of a recorder that died");
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadOnly),
            cannot + needs + "; copy it and its -wal elsewhere");
  EXPECT_EQ(errorOfNobody(folder.path("new.db"), OpenMode::ReadWrite),
            "sqlite:" + folder.path("new.db") + ": cannot open the store: it cannot be made in " +
                root + ": Permission denied");
  fs::permissions(path, fs::perms(0600));
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadOnly),
            cannot + "the file is not to be read: Permission denied");
  fs::permissions(root, fs::perms(0700));
  EXPECT_EQ(errorOfNobody(path, OpenMode::ReadOnly),
            "sqlite:" + path + ": cannot reach the store: Permission denied");
}

TEST(StoreFile, showsNoPasswordAndRefusesItWhereOthersRead) {
  for (const char* uri : {"mongo://u:secret@h/d", "mongo://u:sec@ret@h/d", "mongo://u:sec/ret@h/d"}) {
    EXPECT_EQ(openError(uri, OpenMode::ReadOnly).substr(0, 12), "mongo://h/d:") << uri;
    EXPECT_THROW(refusePassword("~store", uri), StoreError);
  }
  for (const char* uri : {"mongodb://h:27017,i:27018/d@x", "mongodb://u@h/d", "/a/b:c@d", "@/file"}) {
    EXPECT_NO_THROW(refusePassword("~store", uri)) << uri;
  }
}

fs::perms modeOf(const std::string& path) { return fs::status(path).permissions(); }

TEST(StoreFile, isItsOwnersAlone) {
  const TempFolder folder;
  const mode_t before = umask(0);
  const std::string path = folder.path("a/b/store.db");
  const auto store = openStore(path, OpenMode::Record);
  store->addRecording({0, "", "x", ""});
  umask(before);
  for (const char* name : {"a", "a/b"}) {
    EXPECT_EQ(modeOf(folder.path(name)), fs::perms::owner_all) << name;
  }
  const auto own = fs::perms::owner_read | fs::perms::owner_write;
  for (const char* end : {"", "-wal", "-shm", ".lock"}) EXPECT_EQ(modeOf(path + end), own) << end;
}

TEST(StoreFile, isOthersToReadIfThatIsAsked) {
  const TempFolder folder;
  const mode_t before = umask(077);
  setenv("AFTERGLOW_STORE_ACCESS", "all", 1);
  openStore(folder.path("a/store.db"), OpenMode::Record);
  EXPECT_EQ(modeOf(folder.path("a")), fs::perms(0775));
  EXPECT_EQ(modeOf(folder.path("a/store.db")), fs::perms(0664));
  setenv("AFTERGLOW_STORE_ACCESS", "group", 1);
  openStore(folder.path("c/store.db"), OpenMode::Record);
  EXPECT_EQ(modeOf(folder.path("c")), fs::perms(0770));
  EXPECT_EQ(modeOf(folder.path("c/store.db")), fs::perms(0660));
  setenv("AFTERGLOW_STORE_ACCESS", "everybody", 1);
  EXPECT_NE(openError(folder.path("b.db"), OpenMode::ReadWrite)
                .find("AFTERGLOW_STORE_ACCESS is \"everybody\": private, group or all"),
            std::string::npos);
  unsetenv("AFTERGLOW_STORE_ACCESS");
  umask(before);
  openStore(folder.path("a/store.db"), OpenMode::Record);
  EXPECT_EQ(modeOf(folder.path("a/store.db")), fs::perms(0664)) << "what is there keeps its mode";
}

TEST(StoreFile, canBeReadFromAReadOnlyFolder) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root, to become somebody who may not write";
  if (sqlite3_libversion_number() < 3'040'000) {
    GTEST_SKIP() << "SQLite " << sqlite3_libversion() << " reads no log where it cannot write";
  }
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  openStore(path, OpenMode::ReadWrite)->addRecording({0, "", "x", ""});
  fs::permissions(path, fs::perms(0644));
  fs::permissions(folder.path(""), fs::perms(0555));
  ASSERT_EQ(seteuid(65534), 0);
  const std::string error = openError(path, OpenMode::ReadOnly);
  std::string write_error;
  try {
    openStore(path, OpenMode::ReadOnly)->addRecording({0, "", "x", ""});
  } catch (const StoreError& refused) {
    write_error = refused.what();
  }
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(error, "");
  EXPECT_EQ(write_error, "sqlite:" + path + ": cannot write: attempt to write a readonly database");
}

TEST(StoreFile, survivesDamageAnywhereWithoutACrash) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  {
    const auto store = openStore(path, OpenMode::ReadWrite);
    const auto recording = store->addRecording({0, "", "x", ""});
    const auto channel = store->addChannel(recording, stringChannel("/a"));
    for (std::uint64_t i = 0; i < 50; ++i) {
      store->append({stringMessage(channel, 1, i, std::string(300, 'x'))});
    }
    store->addBehavior(sampleBehavior(recording, {"/a"}, 0, 9));
  }
  const std::string whole = fileBytes(path);
  const auto readEverything = [](const std::string& file) {
    try {
      const auto store = openStore(file, OpenMode::ReadOnly);
      for (const Behavior& behavior : store->behaviors({})) {
        store->topics(behavior);
        readAll(*store->messages(behavior, {}));
      }
    } catch (const StoreError&) {
    }
  };
  const std::string damaged = folder.path("damaged.db");
  for (std::size_t size = 0; size < whole.size(); size += 2047) {
    writeFile(damaged, whole.substr(0, size));
    readEverything(damaged);
  }
  for (std::size_t at = 16; at < whole.size(); at += 911) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(~bytes[at]);
    writeFile(damaged, bytes);
    readEverything(damaged);
  }
}

// ------------------------------------------------------------------- processes that come to grief

constexpr std::uint64_t kInBatch = 20;

/// Appends batches to a recording of its own for ever; writes a byte to `acknowledged` after each.
[[noreturn]] void appendForEver(const std::string& path, int acknowledged) {
  try {
    const auto store = openStore(path, OpenMode::Record);
    const auto recording = store->addRecording({0, "", "x", ""});
    const auto channel = store->addChannel(recording, stringChannel("/a"));
    Behavior behavior = sampleBehavior(recording, {"/a"}, 0, 0);
    behavior.end.reset();
    store->addBehavior(behavior);
    for (std::uint64_t sequence = 0;;) {
      std::vector<Message> batch;
      for (std::uint64_t i = 0; i < kInBatch; ++i, ++sequence) {
        batch.push_back(stringMessage(channel, static_cast<std::int64_t>(sequence), sequence,
                                      std::string(1000, 'x')));
      }
      store->append(batch);
      if (write(acknowledged, "+", 1) != 1) _exit(3);
    }
  } catch (const StoreError& error) {
    const std::string text = error.what();
    static_cast<void>(write(acknowledged, text.data(), text.size()));
    _exit(1);
  }
}

struct Writer {
  pid_t process;
  int acknowledged;
};

template <typename Prepare>
Writer startWriter(const std::string& path, const Prepare& prepare) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  const pid_t process = fork();
  if (process == 0) {
    close(ends[0]);
    prepare();
    appendForEver(path, ends[1]);
  }
  close(ends[1]);
  return {process, ends[0]};
}

/// Waits for so many acknowledged batches and then for a moment that no batch knows of; how many
/// were acknowledged when the process was dead.
std::uint64_t killAfter(const Writer& writer, std::uint64_t batches,
                        std::chrono::microseconds more) {
  std::uint64_t acknowledged = 0;
  char byte = 0;
  while (acknowledged < batches && read(writer.acknowledged, &byte, 1) == 1) ++acknowledged;
  const auto until = std::chrono::steady_clock::now() + more;
  while (std::chrono::steady_clock::now() < until) std::this_thread::yield();
  kill(writer.process, SIGKILL);
  while (read(writer.acknowledged, &byte, 1) == 1) ++acknowledged;
  waitpid(writer.process, nullptr, 0);
  close(writer.acknowledged);
  return acknowledged;
}

/// One recorder after the other dies on the same store, while it opens it, too. On a disk that is
/// not waited for, so that the instants lie in SQLite's work.
TEST(StoreFile, keepsWhatWasAppendedBeforeAnyOf200Kills) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  openStore(path, OpenMode::ReadWrite);
  std::minstd_rand random(5);
  std::size_t recordings = 0;
  for (int round = 0; round < 200; ++round) {
    SCOPED_TRACE("kill " + std::to_string(round));
    const Writer writer = startWriter(path, [] { new FaultyDisk; });  // until it is killed
    const std::uint64_t batches = random() % 4;
    const std::uint64_t acknowledged =
        killAfter(writer, batches, std::chrono::microseconds(random() % 5000));

    const auto store = openStore(path, OpenMode::ReadOnly);
    const auto all = store->recordings();
    ASSERT_TRUE(acknowledged == 0 || all.size() > recordings);
    recordings = all.size();
    for (const Behavior& behavior : store->behaviors({})) {
      if (behavior.recording != all.back().id) continue;
      EXPECT_EQ(behavior.outcome, kIncomplete);
      const auto messages = readAll(*store->messages(behavior, {}));
      EXPECT_GE(messages.size(), acknowledged * kInBatch);
      EXPECT_EQ(messages.size() % kInBatch, 0u) << "half a batch";
      for (std::size_t i = 0; i < messages.size(); ++i) ASSERT_EQ(messages[i].sequence, i);
      const auto topics = store->topics(behavior);
      EXPECT_EQ(topics.empty() ? 0 : topics[0].count, messages.size());
    }
  }
  EXPECT_GT(recordings, 100u);
  openStore(path, OpenMode::Record);
  EXPECT_EQ(checkStore(path).problems, std::vector<std::string>{});
  for (const Behavior& behavior : openStore(path, OpenMode::ReadOnly)->behaviors({})) {
    EXPECT_TRUE(behavior.end);
    EXPECT_EQ(behavior.outcome, kIncomplete);
  }
}

TEST(StoreFile, saysThatTheDiskIsFullAndKeepsWhatItHas) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  const Writer writer = startWriter(path, [] {
    // Writing beyond the limit fails as on a full disk.
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{3'000'000, 3'000'000};
    setrlimit(RLIMIT_FSIZE, &limit);
  });
  std::string said;
  char byte = 0;
  while (read(writer.acknowledged, &byte, 1) == 1) said += byte;
  int status = 0;
  waitpid(writer.process, &status, 0);
  close(writer.acknowledged);
  ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << said;
  const std::size_t acknowledged = said.find_first_not_of('+');
  EXPECT_EQ(said.substr(acknowledged, path.size() + 15), "sqlite:" + path + ": cannot");

  const auto store = openStore(path, OpenMode::ReadOnly);
  EXPECT_EQ(readAll(*store->messages(store->behaviors({}).at(0), {})).size(),
            acknowledged * kInBatch);
  EXPECT_GT(acknowledged, 10u);
}

}  // namespace
}  // namespace afterglow::replay::store_file_test
