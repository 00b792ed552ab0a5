// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <libpq-fe.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <memory>
#include <sstream>

#include "maps/hub/hub_connection.h"

namespace docent::maps {

namespace {

// By ascending safety, as libpq lists them.
constexpr std::array<const char*, 6> kTlsModes = {"disable", "allow",     "prefer",
                                                  "require", "verify-ca", "verify-full"};
constexpr std::size_t kRequire = 3;

using ConnectionOptions = std::map<std::string, std::string>;

ConnectionOptions ParseAddress(const std::string& url) {
  if (!url.starts_with("postgresql://") && !url.starts_with("postgres://"))
    throw Error(
        "the address of a hub begins with postgresql://, as in postgresql://anna@museum.example/docent");
  char* reason = nullptr;
  const std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)> parsed(
      PQconninfoParse(url.c_str(), &reason), PQconninfoFree);
  const std::unique_ptr<char, void (*)(void*)> owned(reason, PQfreemem);
  if (!parsed)
    throw Error("the address of the hub is not valid; write it as postgresql://user@host/database");
  ConnectionOptions options;
  for (const PQconninfoOption* option = parsed.get(); option->keyword; ++option) {
    if (option->val) options[option->keyword] = option->val;
  }
  return options;
}

bool IsLoopback(const std::string& host) {
  if (host == "localhost" || host.starts_with('/') || host.starts_with('@')) return true;
  in_addr four{};
  in6_addr six{};
  if (inet_pton(AF_INET, host.c_str(), &four) == 1) return (ntohl(four.s_addr) >> 24) == 127;
  return inet_pton(AF_INET6, host.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six);
}

// An option as libpq will use it: from the address, or else from the environment.
std::string EffectiveOption(const ConnectionOptions& options, const char* keyword, const char* variable) {
  if (const auto found = options.find(keyword); found != options.end()) return found->second;
  const char* value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nothing here changes them.
  return value ? value : "";
}

// Whether every host that libpq may connect to is this machine. A service file may name any host.
bool StaysOnThisMachine(const ConnectionOptions& options) {
  if (!EffectiveOption(options, "service", "PGSERVICE").empty()) return false;
  std::string hosts = EffectiveOption(options, "hostaddr", "PGHOSTADDR");
  if (hosts.empty()) hosts = EffectiveOption(options, "host", "PGHOST");
  std::istringstream list(hosts);
  std::string host;
  while (std::getline(list, host, ',')) {
    if (!host.empty() && !IsLoopback(host)) return false;
  }
  return true;
}

std::string Quoted(const std::string& value) {
  std::string quoted = "'";
  for (const char c : value) {
    if (c == '\'' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "'";
}

}  // namespace

std::string CheckedHubAddress(const std::string& url) {
  ConnectionOptions options = ParseAddress(url);
  if (options.contains("password") || options.contains("sslpassword"))
    throw Error(
        "the address of the hub contains a password, which others can read on the command line; put it into "
        "~/.pgpass instead (docs/hub.md)");
  if (!StaysOnThisMachine(options)) {
    const std::string mode = EffectiveOption(options, "sslmode", "PGSSLMODE");
    const auto known = std::find(kTlsModes.begin(), kTlsModes.end(), mode);
    if (!mode.empty() && known - kTlsModes.begin() < static_cast<std::ptrdiff_t>(kRequire))
      throw Error("a hub on another machine needs an encrypted connection; sslmode=" + mode +
                  " does not ensure it, use require or verify-full");
    options["sslmode"] = mode.empty() ? kTlsModes[kRequire] : mode;
  }
  // So that a network that is gone shows as an error within half a minute and not after hours.
  for (const auto& [keyword, value] :
       {std::pair("connect_timeout", "10"), std::pair("tcp_user_timeout", "15000"),
        std::pair("keepalives_idle", "10"), std::pair("keepalives_interval", "5"),
        std::pair("keepalives_count", "3"), std::pair("client_encoding", "UTF8"),
        std::pair("application_name", "docent")})
    options.try_emplace(keyword, value);
  std::string text;
  for (const auto& [keyword, value] : options) text += keyword + "=" + Quoted(value) + " ";
  return text;
}

std::string VerifierOf(const std::string& url, const std::string& user, const std::string& password) {
  const std::unique_ptr<PGconn, void (*)(PGconn*)> connection(PQconnectdb(CheckedHubAddress(url).c_str()),
                                                              PQfinish);
  if (PQstatus(connection.get()) != CONNECTION_OK) throw HubUnreachable("the hub cannot be reached");
  const std::unique_ptr<char, void (*)(void*)> verifier(
      PQencryptPasswordConn(connection.get(), password.c_str(), user.c_str(), "scram-sha-256"), PQfreemem);
  if (!verifier) throw Error("the password cannot be encrypted");
  return verifier.get();
}

}  // namespace docent::maps
