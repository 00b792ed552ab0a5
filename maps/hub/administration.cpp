// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/administration.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "maps/hub/hub.h"
#include "maps/hub/hub_connection.h"

namespace docent::maps {

// Made from schema/version_N.sql.
extern const unsigned char kHubSchema1[];
extern const std::size_t kHubSchema1_size;
extern const unsigned char kHubSchema2[];
extern const std::size_t kHubSchema2_size;

namespace {

std::string_view ScriptOf(int version) {
  const std::array<std::string_view, kHubVersion> scripts = {
      std::string_view(reinterpret_cast<const char*>(kHubSchema1), kHubSchema1_size),
      std::string_view(reinterpret_cast<const char*>(kHubSchema2), kHubSchema2_size)};
  return scripts.at(static_cast<std::size_t>(version) - 1);
}

// The same address with the database that every server has, and the name of the database that it had.
std::pair<std::string, std::string> ServerOf(const std::string& url) {
  const std::size_t host = url.find("//") + 2;
  const std::size_t slash = url.find('/', host);
  if (slash == std::string::npos) return {};
  const std::size_t end = std::min(url.find('?', slash), url.size());
  return {url.substr(0, slash + 1) + "postgres" + url.substr(end), url.substr(slash + 1, end - slash - 1)};
}

// Whether the name can be written in a statement as it is.
bool IsPlainName(const std::string& name) {
  return !name.empty() && name.size() < 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

// Creates the database of the address; returns false if that cannot be what is missing.
bool CreateHubDatabase(const std::string& url) {
  const std::pair<std::string, std::string> place = ServerOf(url);
  const std::string &server = place.first, &name = place.second;
  if (!IsPlainName(name)) return false;
  HubConnection connection(server);
  bool exists = false;
  connection.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    exists = work.Query("SELECT FROM pg_database WHERE datname = $1", {name}).size() > 0;
  });
  if (exists) return false;
  connection.ExecuteAlone("CREATE DATABASE \"" + name + "\" ENCODING 'UTF8' TEMPLATE template0");
  return true;
}

}  // namespace

HubInit InitHub(const std::string& url) {
  HubInit init;
  std::unique_ptr<HubConnection> connection;
  try {
    connection = std::make_unique<HubConnection>(url);
  } catch (const HubUnreachable&) {
    init.created_database = CreateHubDatabase(url);
    if (!init.created_database) throw;
    connection = std::make_unique<HubConnection>(url);
  }
  connection->Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    // Two programs that do this at once would otherwise both begin; the number is any that only this uses.
    work.Query("SELECT pg_advisory_xact_lock(4931217)");
    if (work.Query("SELECT FROM pg_tables WHERE schemaname = 'docent' AND tablename = 'hub'").size() > 0)
      init.version_before = static_cast<int>(work.Query("SELECT version FROM docent.hub").Integer(0, 0));
    if (init.version_before > kHubVersion) throw Error("the hub was made by a newer Docent; update Docent");
    for (int version = init.version_before + 1; version <= kHubVersion; ++version)
      work.Execute(std::string(ScriptOf(version)));
    init.version = kHubVersion;
  });
  return init;
}

void AddHubUser(const std::string& url, const std::string& name, const std::string& role,
                const std::optional<std::string>& password) {
  const std::string verifier = password ? VerifierOf(url, name, *password) : "";
  HubConnection connection(url);
  connection.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    work.Query("SELECT docent.add_user($1, $2)", {name, role});
    if (password) work.Query("SELECT docent.set_password($1, $2)", {name, verifier});
  });
}

void RemoveHubUser(const std::string& url, const std::string& name) {
  HubConnection connection(url);
  connection.Transact(HubAccess::kWrite,
                      [&](HubTransaction& work) { work.Query("SELECT docent.remove_user($1)", {name}); });
}

std::vector<HubUser> ListHubUsers(const std::string& url) {
  std::vector<HubUser> users;
  HubConnection connection(url);
  connection.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query("SELECT name, role FROM docent.list_users()");
    for (std::size_t i = 0; i < rows.size(); ++i) users.push_back({rows.Text(i, 0), rows.Text(i, 1)});
  });
  return users;
}

HubStatus StatusOf(const std::string& url, int changes) {
  HubStatus status;
  HubConnection connection(url);
  connection.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT session_user, CASE WHEN pg_has_role('docent_admin', 'USAGE') THEN 'admin' "
        "WHEN pg_has_role('docent_curator', 'USAGE') THEN 'curator' "
        "WHEN pg_has_role('docent_visitor', 'USAGE') THEN 'visitor' ELSE '' END, version, "
        "(SELECT count(*) FROM docent.maps WHERE NOT removed), "
        "(SELECT count(*) FROM docent.tours WHERE NOT removed), (SELECT count(*) FROM docent.revisions), "
        "kept_revisions, pg_database_size(current_database()), "
        "coalesce((SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()), false) FROM docent.hub");
    status.user = rows.Text(0, 0);
    status.role = rows.Text(0, 1);
    status.version = rows.Integer(0, 2);
    status.maps = rows.Integer(0, 3);
    status.tours = rows.Integer(0, 4);
    status.revisions = rows.Integer(0, 5);
    status.kept_revisions = rows.Integer(0, 6);
    status.bytes = rows.Integer(0, 7);
    status.encrypted = rows.Truth(0, 8);
    if (status.role != "curator" && status.role != "admin") return;
    const HubRows log = work.Query(
        "SELECT change, to_char(made_at AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"'), made_by, "
        "what, subject, "
        "coalesce(revision, 0) FROM docent.changes ORDER BY change DESC LIMIT $1::integer",
        {std::to_string(changes)});
    for (std::size_t i = 0; i < log.size(); ++i)
      status.changes.push_back({log.Integer(i, 0), log.Text(i, 1), log.Text(i, 2), log.Text(i, 3),
                                log.Text(i, 4), log.Integer(i, 5)});
  });
  return status;
}

std::int64_t RevertHubMap(const std::string& url, const std::string& name, std::int64_t to_revision) {
  Hub hub(url);
  const std::vector<HubHead> heads = hub.Heads();
  // A removed map can be put back too, if no other has its name.
  const HubHead* found = nullptr;
  for (const HubHead& head : heads) {
    if (head.name == name && (found == nullptr || !head.removed)) found = &head;
  }
  if (found == nullptr) throw Error("the hub has no map named '" + name + "'");
  return hub.RevertMap(found->id, found->revision, to_revision);
}

}  // namespace docent::maps
