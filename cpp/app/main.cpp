// liealign-post: `liealign run` as one executable, without Python: the same config, flags, files, numbers, exit codes.
// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <sstream>

#include "flight_toml.hpp"
#include "liealign/core/error.hpp"
#include "liealign/pipeline/clock.hpp"
#include "liealign/pipeline/config_files.hpp"
#include "liealign/pipeline/run_text.hpp"
#include "liealign/pipeline/settings.hpp"

namespace liealign::app {
namespace {

enum Exit { kDone = 0, kBadInput = 1, kUsage = 2, kNumerical = 3, kNotAligned = 4, kInterrupted = 130 };

enum Kind { kText, kNumber, kThree, kMany };  // what the words of a flag are

// A flag that stands for a configuration key; the same ones as FLAGS in python/liealign/cli/flags.py.
struct Flag {
  const char *name, *key, *shown, *help;
  Kind kind = kText;
};

constexpr Flag kFlags[] = {
    {"--imu", "imu.file", "FILE", "Native imu.csv."},
    {"--gnss", "gnss.file", "FILE", "Native gnss.csv."},
    {"--lever-arm", "gnss.lever_arm_b_m", "X Y Z", "From the IMU to the antenna: forward, right, down [m].", kThree},
    {"--imu-model", "imu.model", "NAME", "Noise profile of the IMU."},
    {"--gnss-latency", "gnss.latency_s", "SECONDS|auto", "Of the GNSS stamps: t_true = time_s - latency.", kNumber},
    {"--axes", "imu.axes", "FRD|FLU|...", "Where the sensor's x, y, z point on the vehicle."},
    {"--gyro-unit", "imu.gyro_unit", "rps|dps", "Unit of the gyro columns."},
    {"--accel-unit", "imu.accel_unit", "mps2|g", "Unit of the accelerometer columns."},
    {"--heading-guess", "align.heading_guess_deg", "DEG", "Heading at the start, when you know it roughly.", kNumber},
    {"--heading-guess-std", "align.heading_guess_std_deg", "DEG", "Standard deviation of the guess.", kNumber},
    {"--imu-noise-scale", "imu.noise_scale", "NUMBER|auto", "Factor on every IMU noise.", kNumber},
    {"--gnss-std-scale", "gnss.std_scale", "NUMBER|auto", "Factor on the GNSS standard deviations.", kNumber},
    {"--format", "output.formats", "csv sbet", "Trajectory files to write, one or more words.", kMany},
    {"--start-time", "output.start_time_s", "SECONDS", "First time of the trajectory files.", kNumber},
    {"--stop-time", "output.stop_time_s", "SECONDS", "Last time of the trajectory files.", kNumber},
    {"--start", "align.start", "auto|static|moving", "Whether the log starts at rest or in motion."},
};

struct Arguments {
  std::string toml, output;
  std::vector<std::string> words[std::size(kFlags)];
  bool filtered = false, require_aligned = false, quiet = false;
};

void declare(CLI::App& cli, Arguments& a) {
  cli.add_option("FLIGHT.toml", a.toml, "The configuration of the flight.")->type_name("");
  cli.add_option("-o,--output", a.output, "Folder for the results.")->type_name("OUT")->required()->take_last();
  for (std::size_t i = 0; i < std::size(kFlags); ++i) {
    const Flag& flag = kFlags[i];
    CLI::Option* option = cli.add_option(flag.name, a.words[i], flag.help)->type_name(flag.shown);
    // Given twice, the last one counts; what follows its words is not its own.
    option->expected(1, flag.kind == kThree ? 3 : 1)->trigger_on_parse()->allow_extra_args(false);
  }
  cli.add_flag("--filtered", a.filtered, "Write filtered.csv as well.");
  cli.add_flag("--require-aligned", a.require_aligned, "Exit with code 4 unless the verdict is \"aligned\".");
  cli.add_flag("--quiet", a.quiet, "Print nothing but errors.");
  cli.set_version_flag("--version", "liealign-post " LIEALIGN_VERSION);
}

// Words as CLI11 can take them: last one first; -.3, which it would take for a flag, as -0.3; and the words of --format,
// however many, joined into one. They have no point and no slash, so that a file name ends them.
std::vector<std::string> words_for_cli11(const std::vector<std::string>& given) {
  const auto is_format = [](const std::string& word) {
    return word.find_first_not_of(",abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789") ==
           std::string::npos;
  };
  std::vector<std::string> words;
  bool in_format = false;
  for (const std::string& word : given) {
    if (in_format && is_format(word)) {
      words.back() += (words.back().ends_with("--format") ? "=" : " ") + word;
      continue;
    }
    in_format = word == "--format" || word.starts_with("--format=");
    words.push_back(word.starts_with("-.") ? "-0" + word.substr(1) : word);
  }
  std::reverse(words.begin(), words.end());
  return words;
}

std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// What is no number stays text: "auto", or something for the field table to refuse by name.
ConfigValue value_of(const Flag& flag, const std::vector<std::string>& words) {
  const std::string text = CLI::detail::join(words, " ");
  if (flag.kind == kText) return text;
  if (flag.kind == kNumber) return number_in(text) ? ConfigValue(*number_in(text)) : text;
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::istringstream stream(spaced);
  const std::vector<std::string> split{std::istream_iterator<std::string>(stream), {}};
  if (flag.kind == kMany) return split;
  std::vector<double> values;
  for (const std::string& word : split) {
    if (!number_in(word)) return text;
    values.push_back(*number_in(word));
  }
  return values;
}

// FLIGHT.toml, then the flags, each under its own name in messages.
Config config_from(const CLI::App& cli, const Arguments& a) {
  Config config = cli.count("FLIGHT.toml") > 0 ? read_flight_toml(plain_path(a.toml)) : Config{};
  for (std::size_t i = 0; i < std::size(kFlags); ++i) {
    const Flag& flag = kFlags[i];
    if (cli.count(flag.name) > 0) config = apply_config(config, {{flag.key, value_of(flag, a.words[i])}}, flag.name);
  }
  if (a.filtered) config = apply_config(config, {{"output.filtered", true}}, "--filtered");
  return config;
}

// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables): a signal handler has no other way to speak
volatile std::sig_atomic_t interrupted = 0;  // by Ctrl-C; the second one ends the program at once

void stop_if_interrupted() {
  if (interrupted != 0) throw Cancelled("interrupted");
}

// One line on stderr, rewritten, when that is a terminal and the work takes more than a second.
Progress progress_line(const char* text, bool quiet) {
  const bool wanted = !quiet && isatty(STDERR_FILENO) != 0;
  return [=, begin = std::chrono::steady_clock::now()](std::size_t done, std::size_t total) {
    if (wanted && std::chrono::steady_clock::now() - begin > std::chrono::seconds(1)) {
      std::fprintf(stderr, "\r\x1b[K%s: %zu %%", text, 100 * done / std::max<std::size_t>(total, 1));
    }
    return interrupted == 0;
  };
}

void remove_progress_line() {
  if (isatty(STDERR_FILENO) != 0) std::fputs("\r\x1b[K", stderr);
}

HeadingResult align(const PreparedFlight& flight, bool quiet) {
  constexpr std::size_t kUsualConditional = 10;  // candidates of the second stage; only the progress guesses by it
  const Progress progress = progress_line("aligning the heading", quiet);
  HeadingSearch search(heading_search_options(flight));
  std::vector<HeadingCandidate> candidates = search.ask();
  std::size_t done = 0, total = candidates.size() + kUsualConditional;
  while (!search.done()) {
    search.tell(evaluate_candidates(flight.problem, candidates));
    done += candidates.size();
    candidates = search.ask();
    total = std::max(total, done + candidates.size());
    if (!progress(done, total)) stop_if_interrupted();
  }
  return with_clock_of_flight(flight, search.result());
}

int fail(std::string message, Exit code) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  remove_progress_line();
  std::fprintf(stderr, "%s\n", message.c_str());
  return code;
}

int run(const CLI::App& cli, const Arguments& a) {
  const std::string folder = plain_path(a.output);
  const Config config = config_from(cli, a);
  if (std::filesystem::exists(folder) && !std::filesystem::is_directory(folder)) {
    throw InputError(folder + ": is a file; -o expects a folder for the results");
  }
  const PreparedFlight flight = prepare_flight(read_flight(config));
  stop_if_interrupted();
  const HeadingResult heading = align(flight, a.quiet);
  if (a.require_aligned && heading.verdict != "aligned") {
    return fail("the heading is \"" + heading.verdict + "\", --require-aligned demands \"aligned\": " + heading.advice,
                kNotAligned);
  }
  ResultFiles files(folder, flight, heading);
  const Solution solution =
      process(flight, heading, files.smoothed(), files.filtered(), progress_line("filtering and smoothing", a.quiet));
  stop_if_interrupted();
  files.finish(solution);
  remove_progress_line();
  if (a.quiet) return kDone;
  for (const TextLine& line : run_text(flight, heading, solution, folder))
    std::printf("%-9s %s\n", line.label.c_str(), line.text.c_str());
  return kDone;
}

}  // namespace
}  // namespace liealign::app

// NOLINTNEXTLINE(bugprone-exception-escape): outside the try blocks only a mistake in the flags throws
int main(int argc, char** argv) {
  using namespace liealign::app;
  CLI::App cli("Heading alignment and smoothed GNSS/INS trajectories. Flags are stronger than FLIGHT.toml.",
               "liealign-post");
  Arguments arguments;
  declare(cli, arguments);
  try {
    cli.parse(words_for_cli11({argv + 1, argv + argc}));
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? kDone : kUsage;
  }
  std::signal(SIGINT, [](int) {
    interrupted = 1;
    std::signal(SIGINT, SIG_DFL);
  });
  try {
    return run(cli, arguments);
  } catch (const liealign::NumericalError& error) {
    return fail(error.what(), kNumerical);
  } catch (const liealign::Cancelled&) {
    return fail("interrupted", kInterrupted);
  } catch (const std::exception& error) {
    return fail(error.what(), kBadInput);
  }
}
