// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_connection.h"

#include <charconv>
#include <cmath>
#include <pqxx/pqxx>
#include <utility>

namespace docent::maps {

namespace {

// The first line of a message of the server or of libpq, without what would move the cursor of a terminal.
std::string FirstLine(const std::string& message) {
  std::string line = message.substr(0, message.find('\n'));
  for (const char* prefix : {"ERROR:  ", "FATAL:  "}) {
    if (const auto at = line.find(prefix); at != std::string::npos) line = line.substr(at + 8);
  }
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  }
  return line.substr(0, 400);
}

// The number of an error. libpqxx leaves it out of the errors that have a type of their own.
std::string StateOf(const pqxx::sql_error& error) {
  if (dynamic_cast<const pqxx::insufficient_privilege*>(&error)) return "42501";
  if (dynamic_cast<const pqxx::undefined_table*>(&error)) return "42P01";
  if (dynamic_cast<const pqxx::disk_full*>(&error)) return "53100";
  if (dynamic_cast<const pqxx::integrity_constraint_violation*>(&error)) return "23000";
  if (dynamic_cast<const pqxx::data_exception*>(&error)) return "22000";
  return error.sqlstate();
}

[[noreturn]] void FailQuery(const pqxx::sql_error& error) {
  const std::string state = StateOf(error);
  const std::string line = FirstLine(error.what());
  if (state == "DC001") throw HubConflict(line);
  if (state.starts_with("DC")) throw Error(line);
  if (state == "42501") throw Error("your user may not do this on the hub (" + line + ")");
  if (state == "3F000" || state == "42P01")
    throw Error("this database contains no hub; create one with docent hub init");
  if (state == "53100") throw Error("the hub cannot save it because its disk is full");
  if (state.starts_with("57P")) throw HubUnreachable("the hub is shutting down");
  if (state.starts_with("23") || state.starts_with("22"))
    throw Error("the hub refused a value that is not valid (" + line + ")");
  throw Error("the hub refused the request (" + line + ")");
}

// Runs `body` and turns what libpqxx throws into our errors.
template <typename Body>
auto Guarded(const Body& body) {
  try {
    return body();
  } catch (const Error&) {
    throw;
  } catch (const pqxx::broken_connection& error) {
    throw HubUnreachable("the hub cannot be reached (" + FirstLine(error.what()) + ")");
  } catch (const pqxx::sql_error& error) {
    FailQuery(error);
  } catch (const pqxx::failure& error) {
    // If it was lost while the hub committed, nobody knows yet whether it did.
    throw HubUnreachable("the connection to the hub was lost; the next push finds out what was saved (" +
                         FirstLine(error.what()) + ")");
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw Error("the hub answered something that cannot be understood (" + FirstLine(error.what()) + ")");
  }
}

[[noreturn]] void FailValue(const char* expected) {
  throw Error(std::string("the hub sent something that is not ") + expected +
              "; the database is damaged or is not a hub of Docent");
}

}  // namespace

class HubRows::Impl {
 public:
  explicit Impl(const pqxx::result& rows) : rows_(rows) {}  // A result is shared, not copied.
  const pqxx::result& rows() const { return rows_; }

  pqxx::field At(std::size_t row, int column) const {
    if (row >= rows_.size() || column < 0 || column >= static_cast<int>(rows_.columns()))
      FailValue("the expected table");
    return rows_[static_cast<pqxx::result::size_type>(row)][static_cast<pqxx::row::size_type>(column)];
  }
  std::string_view View(std::size_t row, int column) const {
    const pqxx::field field = At(row, column);
    if (field.is_null()) FailValue("a value");
    return {field.c_str(), field.size()};
  }

 private:
  pqxx::result rows_;
};

std::size_t HubRows::size() const {
  return impl_->rows().size();
}

bool HubRows::IsNull(std::size_t row, int column) const {
  return impl_->At(row, column).is_null();
}

std::string HubRows::Text(std::size_t row, int column) const {
  return std::string(impl_->View(row, column));
}

std::int64_t HubRows::Integer(std::size_t row, int column) const {
  const std::string_view text = impl_->View(row, column);
  std::int64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size()) FailValue("a whole number");
  return value;
}

double HubRows::Number(std::size_t row, int column) const {
  const std::string_view text = impl_->View(row, column);
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    FailValue("a number");
  return value;
}

bool HubRows::Truth(std::size_t row, int column) const {
  const std::string_view text = impl_->View(row, column);
  if (text != "t" && text != "f") FailValue("yes or no");
  return text == "t";
}

Bytes HubRows::Blob(std::size_t row, int column) const {
  const pqxx::field field = impl_->At(row, column);
  if (field.is_null()) FailValue("a value");
  const pqxx::binarystring bytes(field);
  return {bytes.begin(), bytes.end()};
}

class HubTransaction::Impl {
 public:
  explicit Impl(pqxx::transaction_base* work) : work_(*work) {}
  pqxx::transaction_base& work() { return work_; }

 private:
  pqxx::transaction_base& work_;
};

HubRows HubTransaction::Query(const std::string& sql, const std::vector<std::string>& parameters) {
  return Guarded([&] {
    return HubRows(std::make_shared<const HubRows::Impl>(
        impl_->work().exec_params(sql, pqxx::prepare::make_dynamic_params(parameters))));
  });
}

HubRows HubTransaction::QueryWithBytes(const std::string& sql, std::span<const std::uint8_t> bytes) {
  return Guarded([&] {
    return HubRows(std::make_shared<const HubRows::Impl>(
        impl_->work().exec_params(sql, pqxx::binarystring(bytes.data(), bytes.size()))));
  });
}

void HubTransaction::Execute(const std::string& script) {
  Guarded([&] { impl_->work().exec(script); });
}

// Counts what was sent on a channel.
class HubReceiver : public pqxx::notification_receiver {
 public:
  using pqxx::notification_receiver::notification_receiver;
  void operator()(const std::string&, int) override { ++received_; }
  int received() const { return received_; }

 private:
  int received_ = 0;
};

class HubConnection::Impl {
 public:
  explicit Impl(const std::string& address) : connection_(address) {
    // The context that PostgreSQL adds to its messages names functions, which says nothing to the user.
    connection_.set_verbosity(pqxx::connection_base::terse);
  }
  pqxx::connection& connection() { return connection_; }
  std::unique_ptr<HubReceiver>& receiver() { return receiver_; }

 private:
  pqxx::connection connection_;
  std::unique_ptr<HubReceiver> receiver_;  // Destroyed before the connection.
};

HubConnection::HubConnection(const std::string& url) {
  const std::string address = CheckedHubAddress(url);
  impl_ = Guarded([&] { return std::make_unique<Impl>(address); });
}

HubConnection::~HubConnection() = default;

void HubConnection::Transact(HubAccess access, const std::function<void(HubTransaction&)>& body) {
  const auto run = [&](pqxx::transaction_base& work) {
    HubTransaction::Impl impl(&work);
    HubTransaction transaction(&impl);
    body(transaction);
    work.commit();
  };
  Guarded([&] {
    if (access == HubAccess::kRead) {
      pqxx::transaction<pqxx::repeatable_read, pqxx::read_only> work(impl_->connection());
      run(work);
    } else {
      pqxx::work work(impl_->connection());
      run(work);
    }
  });
}

void HubConnection::ExecuteAlone(const std::string& statement) {
  Guarded([&] {
    pqxx::nontransaction work(impl_->connection());
    work.exec(statement);
    work.commit();
  });
}

void HubConnection::Listen(const std::string& channel) {
  Guarded([&] { impl_->receiver() = std::make_unique<HubReceiver>(impl_->connection(), channel); });
}

bool HubConnection::Wait(std::chrono::milliseconds longest) {
  return Guarded([&] {
    const int before = impl_->receiver() ? impl_->receiver()->received() : 0;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(longest);
    impl_->connection().await_notification(
        static_cast<long>(seconds.count()),
        static_cast<long>(std::chrono::microseconds(longest - seconds).count()));
    return impl_->receiver() && impl_->receiver()->received() != before;
  });
}

}  // namespace docent::maps
