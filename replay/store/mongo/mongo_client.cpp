#include "replay/store/mongo/mongo_client.hpp"

#include <algorithm>
#include <iterator>
#include <mutex>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

constexpr int kDuplicateKey = 11000;

void startLibrary() {
  static std::once_flag once;
  std::call_once(once, [] {
    // Its counters in shared memory outlive a process that is killed, and confuse the next of its
    // number. A library that starts as it is loaded, as Debian's, is past that already.
    setenv("MONGOC_DISABLE_SHM", "1", 0);
    mongoc_init();
    // Errors are in the exceptions; the library is not to print them, too.
    mongoc_log_set_handler(nullptr, nullptr);
  });
}

struct UriDeleter {
  void operator()(mongoc_uri_t* uri) const { mongoc_uri_destroy(uri); }
};
using Uri = std::unique_ptr<mongoc_uri_t, UriDeleter>;

std::string databaseOf(const mongoc_uri_t& uri) {
  const char* database = mongoc_uri_get_database(&uri);
  return database && *database ? database : "roslog";
}

std::string nameOf(const mongoc_uri_t& uri) {
  std::string hosts;
  for (const mongoc_host_list_t* host = mongoc_uri_get_hosts(&uri); host; host = host->next) {
    hosts += (hosts.empty() ? "" : ",") + std::string(host->host_and_port);
  }
#if MONGOC_CHECK_VERSION(1, 23, 0)
  const char* service = mongoc_uri_get_srv_hostname(&uri);
#else
  const char* service = mongoc_uri_get_service(&uri);  // its name until then
#endif
  if (hosts.empty() && service) hosts = service;
  return "mongodb://" + hosts + "/" + databaseOf(uri);
}

Uri parseUri(const std::string& text, std::chrono::milliseconds patience) {
  startLibrary();
  bson_error_t error;
  Uri uri(mongoc_uri_new_with_error(text.c_str(), &error));
  if (!uri) {
    // Without the text: there may be a password in it.
    throw StoreError(std::string("not a MongoDB URI: ") + error.message);
  }
  const auto setDefault = [&](const char* option, int value) {
    if (!mongoc_uri_has_option(uri.get(), option)) {
      mongoc_uri_set_option_as_int32(uri.get(), option, value);
    }
  };
  setDefault(MONGOC_URI_SERVERSELECTIONTIMEOUTMS, 3000);
  setDefault(MONGOC_URI_CONNECTTIMEOUTMS, 3000);
  setDefault(MONGOC_URI_SOCKETTIMEOUTMS, static_cast<int>(patience.count()));
  const bool names_w = mongoc_uri_has_option(uri.get(), MONGOC_URI_W);
  if (!names_w) mongoc_uri_set_option_as_utf8(uri.get(), MONGOC_URI_W, "majority");
  if (!names_w && !mongoc_uri_has_option(uri.get(), MONGOC_URI_JOURNAL)) {
    mongoc_uri_set_option_as_bool(uri.get(), MONGOC_URI_JOURNAL, true);
  }
  return uri;
}

MongoWrite readWrite(const bson_t& reply, const bson_error_t& error, std::size_t documents) {
  MongoWrite write;
  bson_iter_t at, list, entry;
  if (!bson_iter_init_find(&at, &reply, "writeErrors") || !bson_iter_recurse(&at, &list)) {
    for (std::size_t i = 0; i < documents; ++i) write.refused.insert(i);
    write.why = error.message;
    return write;
  }
  while (bson_iter_next(&list)) {
    if (!bson_iter_recurse(&list, &entry)) continue;
    std::int64_t index = 0, code = 0;
    std::string why;
    while (bson_iter_next(&entry)) {
      const std::string_view key = bson_iter_key(&entry);
      if (key == "index") index = bson_iter_as_int64(&entry);
      if (key == "code") code = bson_iter_as_int64(&entry);
      if (key == "errmsg" && BSON_ITER_HOLDS_UTF8(&entry)) why = bson_iter_utf8(&entry, nullptr);
    }
    (code == kDuplicateKey ? write.duplicates : write.refused)
        .insert(static_cast<std::size_t>(index));
    if (code != kDuplicateKey) write.why = why;
  }
  return write;
}

/// Returns true if the same may succeed later: nobody answers, or not the one that could.
bool isAway(const bson_error_t& error) {
  if (error.domain == MONGOC_ERROR_STREAM || error.domain == MONGOC_ERROR_SERVER_SELECTION ||
      error.domain == MONGOC_ERROR_CLIENT || error.domain == MONGOC_ERROR_WRITE_CONCERN) {
    return true;
  }
  // Of MongoDB's error_codes.yml: host or network, not allowed, over time, shutting down, no
  // primary (any more), no room on the disk.
  constexpr std::uint32_t kPassing[] = {6,     7,     13,    18,    50,    64,    89,    91,  112,
                                        189,   262,   9001,  10107, 11600, 11602, 13435, 13436,
                                        14031};
  return error.domain == MONGOC_ERROR_SERVER &&
         std::find(std::begin(kPassing), std::end(kPassing), error.code) != std::end(kPassing);
}

bool isServersAnswer(const bson_error_t& error) {
  return error.domain == MONGOC_ERROR_SERVER || error.domain == MONGOC_ERROR_WRITE_CONCERN;
}

}  // namespace

/// A connection for the time of a call.
class MongoClient::Lease {
 public:
  explicit Lease(const MongoClient& owner)
      : pool_(owner.pool_.get()), client_(mongoc_client_pool_pop(pool_)) {}
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;
  ~Lease() { mongoc_client_pool_push(pool_, client_); }
  mongoc_client_t* get() const { return client_; }

 private:
  mongoc_client_pool_t* pool_;
  mongoc_client_t* client_;
};

class MongoClient::Collection {
 public:
  Collection(const MongoClient& owner, const std::string& database, const std::string& name)
      : lease_(owner),
        collection_(mongoc_client_get_collection(lease_.get(), database.c_str(), name.c_str())) {}
  Collection(const Collection&) = delete;
  Collection& operator=(const Collection&) = delete;
  ~Collection() { mongoc_collection_destroy(collection_); }
  mongoc_collection_t* get() const { return collection_; }

 private:
  Lease lease_;
  mongoc_collection_t* collection_;
};

MongoClient::MongoClient(const std::string& text, std::chrono::milliseconds patience) {
  const Uri uri = parseUri(text, patience);
  name_ = nameOf(*uri);
  database_ = databaseOf(*uri);
  bson_error_t error;
#if MONGOC_CHECK_VERSION(1, 23, 0)
  pool_.reset(mongoc_client_pool_new_with_error(uri.get(), &error));
#else
  bson_set_error(&error, MONGOC_ERROR_CLIENT, 0, "libmongoc does not say why");
  pool_.reset(mongoc_client_pool_new(uri.get()));
#endif
  if (!pool_) fail("use the URI", error);
  mongoc_client_pool_set_error_api(pool_.get(), MONGOC_ERROR_API_VERSION_2);
  mongoc_client_pool_set_appname(pool_.get(), "afterglow");
}

void MongoClient::fail(const std::string& doing, const std::string& why) const {
  throw StoreError(name_ + ": cannot " + doing + ": " + why);
}

void MongoClient::fail(const std::string& doing, const bson_error_t& error) const {
  const std::string text = name_ + ": cannot " + doing + ": " + error.message;
  if (isAway(error)) throw StoreAway(text);
  throw StoreError(text);
}

Bson MongoClient::command(const std::string& database, const Bson& command,
                          const std::string& doing) const {
  const Lease client(*this);
  Bson reply;
  bson_error_t error;
  bson_destroy(&reply.raw());
  if (!mongoc_client_command_simple(client.get(), database.c_str(), &command.raw(), nullptr,
                                    &reply.raw(), &error)) {
    fail(doing, error);
  }
  return reply;
}

MongoClient::Rows::Rows(const MongoClient& client, const std::string& database,
                        const std::string& collection, const Bson& filter, const Bson& options)
    : client_(client),
      name_(collection),
      collection_(std::make_unique<Collection>(client, database, collection)),
      cursor_(mongoc_collection_find_with_opts(collection_->get(), &filter.raw(), &options.raw(),
                                               nullptr)) {}

MongoClient::Rows::~Rows() { mongoc_cursor_destroy(cursor_); }

const bson_t* MongoClient::Rows::next() {
  const bson_t* document = nullptr;
  if (mongoc_cursor_next(cursor_, &document)) return document;
  bson_error_t error;
  if (mongoc_cursor_error(cursor_, &error)) client_.fail("read " + name_, error);
  return nullptr;
}

std::optional<Bson> MongoClient::findOne(const std::string& database, const std::string& collection,
                                         const Bson& filter, const Bson& sort) const {
  Bson options;
  options.add("limit", 1);
  if (!sort.empty()) options.add("sort", sort);
  std::optional<Bson> found;
  find(database, collection, filter, options, [&](const bson_t& document) {
    found.emplace(document);
    return false;
  });
  return found;
}

std::int64_t MongoClient::count(const std::string& database, const std::string& collection,
                                const Bson& filter) const {
  const Collection in(*this, database, collection);
  bson_error_t error;
  const std::int64_t number =
      mongoc_collection_count_documents(in.get(), &filter.raw(), nullptr, nullptr, nullptr, &error);
  if (number < 0) fail("count " + collection, error);
  return number;
}

MongoWrite MongoClient::insert(const std::string& database, const std::string& collection,
                               const std::vector<Bson>& documents) const {
  if (documents.empty()) return {};
  // A struct around the pointer: GCC has a warning for templates of bson_t, which is aligned.
  struct Pointer {
    const bson_t* to;
  };
  std::vector<Pointer> pointers;
  pointers.reserve(documents.size());
  for (const Bson& document : documents) pointers.push_back({&document.raw()});
  const Collection in(*this, database, collection);
  const Bson options = Bson().add("ordered", false);
  Bson reply;
  bson_error_t error;
  bson_destroy(&reply.raw());
  if (mongoc_collection_insert_many(in.get(), &pointers.data()->to, pointers.size(), &options.raw(),
                                    &reply.raw(), &error)) {
    return {};
  }
  const bool has_errors = bson_has_field(&reply.raw(), "writeErrors");
  // Without its write concern a document is there all the same.
  const bool is_answer = error.domain == MONGOC_ERROR_WRITE_CONCERN ||
                         (isServersAnswer(error) && !isAway(error));
  if (!has_errors && !is_answer) fail("write to " + collection, error);
  return readWrite(reply.raw(), error, documents.size());
}

void MongoClient::upsert(const std::string& database, const std::string& collection,
                         const Bson& document) const {
  bson_iter_t id;
  Bson filter;
  if (!bson_iter_init_find(&id, &document.raw(), "_id") ||
      !bson_append_iter(&filter.raw(), "_id", 3, &id)) {
    fail("write to " + collection, "a document without _id");
  }
  const Collection in(*this, database, collection);
  const Bson options = Bson().add("upsert", true);
  bson_error_t error;
  if (!mongoc_collection_replace_one(in.get(), &filter.raw(), &document.raw(), &options.raw(),
                                     nullptr, &error)) {
    fail("write to " + collection, error);
  }
}

void MongoClient::update(const std::string& database, const std::string& collection,
                         const Bson& filter, const Bson& change) const {
  const Collection in(*this, database, collection);
  bson_error_t error;
  if (!mongoc_collection_update_many(in.get(), &filter.raw(), &change.raw(), nullptr, nullptr,
                                     &error)) {
    fail("change " + collection, error);
  }
}

void MongoClient::remove(const std::string& database, const std::string& collection,
                         const Bson& filter) const {
  const Collection in(*this, database, collection);
  bson_error_t error;
  if (!mongoc_collection_delete_many(in.get(), &filter.raw(), nullptr, nullptr, &error)) {
    fail("remove from " + collection, error);
  }
}

void MongoClient::makeIndex(const std::string& database, const std::string& collection,
                            const std::vector<std::string>& fields, bool is_unique) const {
  Bson keys;
  std::string name;
  for (const std::string& field : fields) {
    bson_append_int32(&keys.raw(), field.c_str(), -1, 1);
    name += (name.empty() ? "" : "_") + field + "_1";  // as every driver names them
  }
  Bson index;
  index.add("key", keys).add("name", name);
  if (is_unique) index.add("unique", true);
  command(database,
          Bson().add("createIndexes", collection).add("indexes", std::vector<Bson>{index}),
          "make an index of " + collection);
}

std::int64_t MongoClient::takeNumber(const std::string& database,
                                     const std::string& counter) const {
  const Bson change = Bson()
                          .add("findAndModify", "counters")
                          .add("query", Bson().add("_id", counter))
                          .add("update", Bson().add("$inc", Bson().add("last", 1)))
                          .add("upsert", true)
                          .add("new", true);
  const Lease client(*this);
  Bson reply;
  bson_error_t error;
  bson_destroy(&reply.raw());
  if (!mongoc_client_write_command_with_opts(client.get(), database.c_str(), &change.raw(), nullptr,
                                             &reply.raw(), &error)) {
    fail("take a number of " + counter, error);
  }
  const auto last = integerAt(reply.raw(), "value.last");
  if (!last) fail("take a number of " + counter, "the server's answer has none");
  return *last;
}

std::vector<std::string> MongoClient::collections(const std::string& database) const {
  const Lease client(*this);
  const std::unique_ptr<mongoc_database_t, void (*)(mongoc_database_t*)> in(
      mongoc_client_get_database(client.get(), database.c_str()), mongoc_database_destroy);
  bson_error_t error;
  char** names = mongoc_database_get_collection_names_with_opts(in.get(), nullptr, &error);
  if (!names) fail("list the collections of " + database, error);
  std::vector<std::string> found;
  for (char** name = names; *name; ++name) found.emplace_back(*name);
  bson_strfreev(names);
  return found;
}

}  // namespace afterglow::replay
