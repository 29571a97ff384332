/// \file
/// The connection to a MongoDB server, in C++ terms. Needs libmongoc; for .cpp files and internal
/// headers of replay/store.
#pragma once

#include <mongoc/mongoc.h>

#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "replay/store/mongo/mongo_bson.hpp"

namespace afterglow::replay {

/// Documents that were not inserted, by their indexes.
struct MongoWrite {
  std::set<std::size_t> duplicates;  ///< documents whose _id or key is there already
  std::set<std::size_t> refused;     ///< the server does not take them
  std::string why;                   ///< reason of the last refusal
};

/// Connections to one deployment, as its URI says: hosts, user, TLS, replica set, read preference,
/// write concern. Where the URI leaves it open: writes are acknowledged by the majority and
/// journaled (w=majority, journal=true), a server is looked for for 3 s (serverSelectionTimeoutMS,
/// connectTimeoutMS), an answer waited for for a minute, `patience` (socketTimeoutMS).
/// Every method may be called from any thread and throws StoreError, which names the server (never
/// the password), what was tried and why it failed.
class MongoClient {
 public:
  explicit MongoClient(const std::string& uri,
                       std::chrono::milliseconds patience = std::chrono::minutes(1));

  const std::string& name() const { return name_; }  ///< "mongodb://HOSTS/DATABASE"
  /// The URI's database, "roslog" if it names none: mongodb_log's default.
  const std::string& database() const { return database_; }

  Bson command(const std::string& database, const Bson& command, const std::string& doing) const;
  /// Calls `take(const bson_t&)` with every document found, until it returns false. `options` as of
  /// the find command: sort, limit, projection.
  template <typename Take>
  void find(const std::string& database, const std::string& collection, const Bson& filter,
            const Bson& options, const Take& take) const {
    Rows rows(*this, database, collection, filter, options);
    while (const bson_t* document = rows.next()) {
      if (!take(*document)) return;
    }
  }
  std::optional<Bson> findOne(const std::string& database, const std::string& collection,
                              const Bson& filter, const Bson& sort = {}) const;
  std::int64_t count(const std::string& database, const std::string& collection,
                     const Bson& filter) const;

  /// Inserts in any order; a document that is refused does not keep out the others.
  MongoWrite insert(const std::string& database, const std::string& collection,
                    const std::vector<Bson>& documents) const;
  /// Replaces the one of this _id, or inserts it.
  void upsert(const std::string& database, const std::string& collection,
              const Bson& document) const;
  void update(const std::string& database, const std::string& collection, const Bson& filter,
              const Bson& change) const;
  void remove(const std::string& database, const std::string& collection, const Bson& filter) const;
  void makeIndex(const std::string& database, const std::string& collection,
                 const std::vector<std::string>& fields, bool is_unique = false) const;
  /// A number that nobody was given before; the first one is 1.
  std::int64_t takeNumber(const std::string& database, const std::string& counter) const;
  std::vector<std::string> collections(const std::string& database) const;

  [[noreturn]] void fail(const std::string& doing, const std::string& why) const;
  /// Throws StoreAway where the same may succeed later.
  [[noreturn]] void fail(const std::string& doing, const bson_error_t& error) const;

 private:
  struct PoolDeleter {
    void operator()(mongoc_client_pool_t* pool) const { mongoc_client_pool_destroy(pool); }
  };
  class Lease;
  class Collection;
  /// The documents that a query finds, one by one.
  class Rows {
   public:
    Rows(const MongoClient& client, const std::string& database, const std::string& collection,
         const Bson& filter, const Bson& options);
    Rows(const Rows&) = delete;
    Rows& operator=(const Rows&) = delete;
    ~Rows();
    const bson_t* next();  ///< null at the end

   private:
    const MongoClient& client_;
    const std::string name_;
    std::unique_ptr<Collection> collection_;
    mongoc_cursor_t* cursor_;
  };

  std::unique_ptr<mongoc_client_pool_t, PoolDeleter> pool_;
  std::string name_, database_;
};

}  // namespace afterglow::replay
