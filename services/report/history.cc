#include "services/report/history.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr int kSchemaVersion = 1;
constexpr int kBusyTimeoutMs = 2000;  // another process reads the file now and then

constexpr const char* kSchema = R"(
CREATE TABLE IF NOT EXISTS schema_version (version INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS part (
  id INTEGER PRIMARY KEY AUTOINCREMENT, part INTEGER NOT NULL, utime INTEGER NOT NULL, verdict INTEGER NOT NULL,
  reason TEXT NOT NULL, report_folder TEXT NOT NULL, UNIQUE (part, utime));
CREATE TABLE IF NOT EXISTS dimension (
  part_id INTEGER NOT NULL REFERENCES part (id), name TEXT NOT NULL, nominal_mm REAL, measured_mm REAL, lower_mm REAL,
  upper_mm REAL, uncertainty_mm REAL, temperature_degc REAL, points INTEGER NOT NULL, rejected_share REAL,
  verdict INTEGER NOT NULL, reason TEXT NOT NULL, PRIMARY KEY (name, part_id)) WITHOUT ROWID;
)";

}  // namespace

struct History::Database {
  sqlite3* handle = nullptr;
  std::string path;

  Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database() { sqlite3_close(handle); }

  Error Failed(const char* what) const {
    const int code = sqlite3_extended_errcode(handle);
    const int family = code & 0xff;
    const ErrorCode kind = family == SQLITE_NOTADB || family == SQLITE_CORRUPT ? ErrorCode::kFormat
                           : family == SQLITE_CONSTRAINT                       ? ErrorCode::kInvalidArgument
                                                                               : ErrorCode::kIo;
    return Fail(kind, "history {}: cannot {}: {} (SQLite code {})", path, what, sqlite3_errmsg(handle), code);
  }
  Status Run(const char* sql, const char* what) {
    return sqlite3_exec(handle, sql, nullptr, nullptr, nullptr) == SQLITE_OK ? Status{} : Failed(what);
  }
  // Writes the version into a new file, compares it in an old one.
  Status CheckVersion();
};

namespace {

// One prepared statement. After a call that failed, nothing more is done and Done() stays false.
class Statement {
 public:
  Statement(sqlite3* handle, const char* sql)
      : code_(sqlite3_prepare_v2(handle, sql, -1, &statement_, nullptr)) {}
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }

  Statement& Bind(std::int64_t value) {
    return Note(code_ == SQLITE_OK ? sqlite3_bind_int64(statement_, ++bound_, value) : code_);
  }
  // NaN is stored as NULL.
  Statement& Bind(double value) {
    return Note(code_ == SQLITE_OK ? sqlite3_bind_double(statement_, ++bound_, value) : code_);
  }
  Statement& Bind(const std::string& text) {
    return Note(code_ == SQLITE_OK ? sqlite3_bind_text(statement_, ++bound_, text.data(),
                                                       static_cast<int>(text.size()), SQLITE_TRANSIENT)
                                   : code_);
  }
  bool Row() { return code_ == SQLITE_OK && (step_ = sqlite3_step(statement_)) == SQLITE_ROW; }
  // After the last Row(), or in place of it for a statement that gives none.
  bool Done() { return code_ == SQLITE_OK && step_ == SQLITE_DONE; }

  std::int64_t Integer(int column) { return sqlite3_column_int64(statement_, column); }
  double Real(int column) {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL ? std::numeric_limits<double>::quiet_NaN()
                                                                  : sqlite3_column_double(statement_, column);
  }
  std::string Text(int column) {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return text == nullptr
               ? ""
               : std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
  }

 private:
  Statement& Note(int code) { return code_ = code, *this; }

  sqlite3_stmt* statement_ = nullptr;
  int code_;
  int step_ = SQLITE_OK;
  int bound_ = 0;
};

std::int64_t Number(Verdict verdict) { return static_cast<std::int64_t>(verdict); }

bool InsertPart(sqlite3* handle, const PartRecord& record) {
  Statement statement(
      handle, "INSERT INTO part (part, utime, verdict, reason, report_folder) VALUES (?, ?, ?, ?, ?)");
  statement.Bind(static_cast<std::int64_t>(record.part)).Bind(record.utime).Bind(Number(record.verdict));
  statement.Bind(record.reason).Bind(record.report_folder).Row();
  return statement.Done();
}

bool InsertDimension(sqlite3* handle, std::int64_t part_id, const JudgedDimension& from) {
  Statement statement(handle, "INSERT INTO dimension VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  statement.Bind(part_id).Bind(from.name).Bind(from.nominal_mm).Bind(from.measured_mm).Bind(from.lower_mm);
  statement.Bind(from.upper_mm).Bind(from.uncertainty_mm).Bind(from.temperature_degc);
  statement.Bind(static_cast<std::int64_t>(from.points)).Bind(from.rejected_share).Bind(Number(from.verdict));
  statement.Bind(from.reason).Row();
  return statement.Done();
}

}  // namespace

Status History::Database::CheckVersion() {
  Statement version(handle, "SELECT version FROM schema_version");
  if (version.Row()) {
    return version.Integer(0) == kSchemaVersion
               ? Status{}
               : Fail(ErrorCode::kFormat,
                      "history {} has version {} of the tables, this program knows version {}", path,
                      version.Integer(0), kSchemaVersion);
  }
  if (!version.Done()) {
    return Failed("read its version");
  }
  const std::string insert = fmt::format("INSERT INTO schema_version VALUES ({})", kSchemaVersion);
  return Run(insert.c_str(), "write its version");
}

History::History(std::unique_ptr<Database> database) : database_(std::move(database)) {}
History::History(History&&) noexcept = default;
History& History::operator=(History&&) noexcept = default;
History::~History() = default;

Result<History> History::Open(const std::string& path) {
  auto database = std::make_unique<Database>();
  database->path = path;
  if (sqlite3_open_v2(path.c_str(), &database->handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr) !=
      SQLITE_OK) {
    return database->Failed("open it");
  }
  sqlite3_busy_timeout(database->handle, kBusyTimeoutMs);
  RETURN_IF_ERROR(database->Run("PRAGMA foreign_keys = ON", "open it"));
  RETURN_IF_ERROR(database->Run("BEGIN IMMEDIATE", "write to it"));
  RETURN_IF_ERROR(database->Run(kSchema, "make its tables"));
  RETURN_IF_ERROR(database->CheckVersion());
  RETURN_IF_ERROR(database->Run("COMMIT", "write its tables"));
  return History(std::move(database));
}

Status History::Append(const PartRecord& record) {
  sqlite3* handle = database_->handle;
  RETURN_IF_ERROR(database_->Run("BEGIN IMMEDIATE", "write to it"));
  bool good = InsertPart(handle, record);
  const std::int64_t part_id = sqlite3_last_insert_rowid(handle);
  for (std::size_t i = 0; good && i < record.dimensions.size(); ++i) {
    good = InsertDimension(handle, part_id, record.dimensions[i]);
  }
  if (good) {
    const Status committed = database_->Run("COMMIT", "write a part to it");
    if (committed.ok()) {
      return committed;
    }
  }
  const Error error = database_->Failed("write a part to it");
  sqlite3_exec(handle, "ROLLBACK", nullptr, nullptr, nullptr);  // the error above is the one to tell
  return error;
}

Result<std::vector<PartRecord>> History::LastParts(int count) const {
  Statement statement(
      database_->handle,
      "SELECT part, utime, verdict, reason, report_folder FROM part ORDER BY id DESC LIMIT ?");
  statement.Bind(static_cast<std::int64_t>(count));
  std::vector<PartRecord> parts;
  while (statement.Row()) {
    parts.push_back({static_cast<int>(statement.Integer(0)),
                     statement.Integer(1),
                     VerdictFromNumber(statement.Integer(2)),
                     statement.Text(3),
                     statement.Text(4),
                     {}});
  }
  return statement.Done() ? Result<std::vector<PartRecord>>(std::move(parts))
                          : database_->Failed("read its parts");
}

Result<std::vector<HistoryPoint>> History::LastValues(const std::string& dimension, int count) const {
  Statement statement(
      database_->handle,
      "SELECT p.id, p.part, p.utime, d.nominal_mm, d.measured_mm, d.lower_mm, d.upper_mm, "
      "d.uncertainty_mm, d.temperature_degc, d.verdict FROM dimension d JOIN part p ON p.id = d.part_id "
      "WHERE d.name = ? ORDER BY d.part_id DESC LIMIT ?");
  statement.Bind(dimension).Bind(static_cast<std::int64_t>(count));
  std::vector<HistoryPoint> points;
  while (statement.Row()) {
    points.push_back({statement.Integer(0), static_cast<int>(statement.Integer(1)), statement.Integer(2),
                      statement.Real(3), statement.Real(4), statement.Real(5), statement.Real(6),
                      statement.Real(7), statement.Real(8), VerdictFromNumber(statement.Integer(9))});
  }
  if (!statement.Done()) {
    return database_->Failed("read its values");
  }
  return std::vector<HistoryPoint>(points.rbegin(), points.rend());
}

}  // namespace forgescan
