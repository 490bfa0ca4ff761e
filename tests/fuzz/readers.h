// The readers of foreign bytes, each behind one function, so that the mutation tests (mutation_test.cc) and
// libFuzzer (fuzz_main.cc) try the same ones. A group of readers is one library with one Readers().
//
// What every reader promises, whatever the bytes: it ends soon, with a value that keeps its description or
// with a sentence; memory stays in proportion to the bytes; no crash.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/result.h"

namespace forgescan::fuzz {

struct Outcome {
  bool accepted = false;
  std::string broken;  // the promise that was broken, one sentence; empty = none
};

struct Reader {
  std::string name;
  int runs = 3000;                 // of the mutation test: some seconds at most
  std::vector<std::string> seeds;  // good files; each is accepted
  std::function<Outcome(const std::string& bytes)> read;
};

// Of the group this program is linked with.
std::vector<Reader> Readers();

// What is wrong with the words of an error, or nothing. name: what it has to call the file; empty = nothing.
std::string SentenceProblem(const Error& error, std::string_view name);

// check(value): what is wrong with an accepted value, or nothing.
template <typename T, typename Check>
Outcome Judge(const Result<T>& result, std::string_view name, Check check) {
  if (!result.ok()) return {false, SentenceProblem(result.error(), name)};
  return {true, check(*result)};
}
template <typename T>
Outcome Judge(const Result<T>& result, std::string_view name) {
  if (!result.ok()) return {false, SentenceProblem(result.error(), name)};
  return {true, {}};
}
// As a status of a Check(): the sentence of the error, or nothing.
inline std::string ProblemOf(const Status& status) { return status.ok() ? "" : status.error().message; }

// A folder of this process, removed at its end.
const std::filesystem::path& ScratchFolder();
// Writes the file into it and returns its path.
std::string ScratchFile(std::string_view name, std::string_view bytes);
// A file of the repository. Ends the program if it is not there.
std::string RepositoryFile(const std::string& path);

}  // namespace forgescan::fuzz
