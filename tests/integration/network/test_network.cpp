// SPDX-License-Identifier: BSD-3-Clause
// Hub and robots as people run them: whatever the network does, the map is that of plumbline fuse.
#include <sqlite3.h>

#include "hot_journal.hpp"
#include "network/network_test.hpp"
#include "store_dump.hpp"

namespace plumbline::integration {
namespace {

using tests::dump;

class Network : public NetworkTest {};

TEST_F(Network, TheMapIsThatOfFuseAndTheEnvironmentIsNotRead) {
  const std::string rubbish = "CYCLONEDDS_URI='<rubbish' ";
  Process h = hub(" --robots 2", rubbish);
  Process a = robot("a", "", rubbish);
  Process b = robot("b", "", rubbish);
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  expect_the_bytes_of_fuse(path("out"));
  for (const std::string name : {"a", "b"}) {
    EXPECT_EQ(dump(path("out/robots") / name / "map.db"), dump(path(name) / "map.db"));
    EXPECT_EQ(slurp(path(name) / "map.db"), slurp(world(name) / "map.db"))
        << "nothing of the network is in it";
    EXPECT_FALSE(fs::exists(path(name) / "map.db-wal"));
    EXPECT_FALSE(fs::exists(path("out/robots") / name / "map.db-wal"));
    const auto told = read_json(path("out/summary.json"))["network"][name];
    EXPECT_GT(told["keyframes"], 2);
    EXPECT_TRUE(told["delivered"]);
    EXPECT_GT(told["bytes"]["place"], 10000);
    EXPECT_GT(told["bytes"]["map"], 10000);
    EXPECT_GT(told["bytes"]["cloud"], 10000);
    EXPECT_GE(told["lag_s"]["p95"], told["lag_s"]["median"]);
  }
  const std::string log = slurp(path("out/hub.log"));
  // Who is named first is who was looked at first.
  const bool a_first = log.find("a and b have met") != std::string::npos;
  const std::string pair = a_first ? "a and b" : "b and a";
  for (const std::string& line : {std::string("a: everything is here"), pair + " look similar",
                                  pair + " have met", std::string("search 1: ")})
    EXPECT_NE(log.find(line), std::string::npos) << line << log;
  const fs::path meeting = path("out/meetings") / (a_first ? "0001_a_b" : "0001_b_a");
  EXPECT_TRUE(fs::exists(meeting / "meeting.json"));
  EXPECT_TRUE(fs::exists(meeting / "map.png"));
  EXPECT_FALSE(fs::exists(path("out.partial")));
}

TEST_F(Network, ALateHubGetsEverything) {
  Process a = robot("a", " --wait 100");
  ASSERT_TRUE(happens([&] { return fs::exists(path("a/map.db")); }, kLong_s)) << a.told();
  Process b = robot("b", " --wait 100");
  ASSERT_TRUE(happens([&] { return fs::exists(path("b.partial/map.db")); }, kLong_s)) << b.told();
  Process h = hub();
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  expect_the_bytes_of_fuse(path("out"));
}

TEST_F(Network, AHubThatIsKilledGoesOn) {
  Process h = hub();
  Process a = robot("a", " --pace 10");
  Process b = robot("b", " --pace 10");
  for (int i = 0; i < 2; ++i) {
    const fs::path copy = path("out.partial/robots/a/map.db");
    ASSERT_TRUE(happens([&] { return fs::exists(copy) || fs::exists(path("out")); }, kLong_s)) << h.told();
    usleep(700000);
    h.end(SIGKILL);
    if (i == 1) {  // as if it was killed while it wrote that file
      const fs::path ledger = path("out.partial/network.db");
      tests::copy_with_hot_journal(ledger, path("left.db"));
      fs::rename(path("left.db"), ledger);
      fs::rename(path("left.db-journal"), ledger.string() + "-journal");
    }
    h = hub(" --robots 2 --resume");
  }
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  expect_the_bytes_of_fuse(path("out"));
}

TEST_F(Network, AHubThatIsKilledFindsTheMeetingsAgain) {
  Process h = hub(" --robots 3");  // one never comes
  std::map<std::string, Process> robots;
  for (const std::string name : {"a", "b"}) {
    fs::copy(world(name), path(name), fs::copy_options::recursive);
    robots[name] = start(name, "robot " + name + " --name " + name + network());
    ASSERT_EQ(robots[name].wait(kLong_s), 0) << robots[name].told() << h.told();
  }
  const fs::path meeting = path("out.partial/meetings/0001_a_b");
  const auto told = [&] { return fs::exists(meeting / "meeting.json"); };
  ASSERT_TRUE(happens(told, kLong_s)) << h.told();
  h.end(SIGKILL);

  // From the same copies, the same meetings.
  std::map<std::string, std::string> first;
  for (int i = 0; i < 2; ++i) {
    fs::remove_all(meeting);
    h = hub(" --robots 3 --resume");
    ASSERT_TRUE(happens(told, kLong_s)) << h.told();
    h.end(SIGKILL);
    for (const char* file : {"meeting.json", "a.txt", "b.txt"}) {
      const std::string bytes = slurp(meeting / file);
      EXPECT_FALSE(bytes.empty()) << file;
      EXPECT_EQ(first.try_emplace(file, bytes).first->second, bytes) << file;
    }
  }
  const std::string log = slurp(path("out.partial/hub.log"));
  EXPECT_NE(log.find("a: is connected"), std::string::npos) << log;
}

TEST_F(Network, ARobotThatIsKilledGoesOn) {
  Process h = hub();
  Process a = robot("a", " --pace 4");
  Process b = robot("b");
  const fs::path copy = path("out.partial/robots/a/map.db");
  ASSERT_TRUE(happens([&] { return fs::exists(copy); }, kLong_s)) << h.told();
  usleep(500000);
  a.end(SIGKILL);
  a = robot("a", " --resume");
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  for (const std::string name : {"a", "b"}) {
    EXPECT_EQ(dump(path("out/robots") / name / "map.db"), dump(path(name) / "map.db"));
  }
  const Outcome fused = run("fuse a b -q -o again" + std::string(kFuse));
  ASSERT_EQ(fused.code, 0) << fused;
  for (const char* file : {"map.ply", "lines.ply", "robots/a/trajectory.txt", "robots/b/trajectory.txt"}) {
    EXPECT_EQ(slurp(path("out") / file), slurp(path("again") / file)) << file;
  }
}

TEST_F(Network, FinishedMapsAreHandedInOverTcp) {
  const std::string tcp = " --transport tcp --port " + std::to_string(20000 + getpid() % 20000);
  Process h = hub(" --robots 2" + tcp);
  std::map<std::string, Process> robots;
  for (const std::string name : {"a", "b"}) {
    fs::copy(world(name), path(name), fs::copy_options::recursive);
    robots[name] = start(name, "robot " + name + " --name " + name + network() + tcp + " --peers 127.0.0.1");
  }
  for (auto& [name, process] : robots) ASSERT_EQ(process.wait(kLong_s), 0) << process.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  expect_the_bytes_of_fuse(path("out"));
}

TEST_F(Network, WhoIsMissingIsNamedAndWhatIsThereIsFused) {
  Process h = hub();
  fs::copy(world("a"), path("a"), fs::copy_options::recursive);
  Process a = start("a", "robot a --name a" + network());
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  // Another run of that name, and a second hub, are told what to do.
  fs::copy(world("b"), path("b"), fs::copy_options::recursive);
  Process other = start("other", "robot b --name a" + network());
  EXPECT_EQ(other.wait(kLong_s), 2) << other.told();
  EXPECT_NE(other.told().find("give this one another --name"), std::string::npos) << other.told();
  Process second = start("second", "hub -o second" + network());
  EXPECT_EQ(second.wait(kLong_s), 2) << second.told();
  EXPECT_NE(second.told().find("another hub is running"), std::string::npos) << second.told();
  h.send(SIGINT);
  EXPECT_EQ(h.wait(kLong_s), 4) << h.told();
  EXPECT_NE(h.told().find("1 of 2 robots did not connect"), std::string::npos) << h.told();
  EXPECT_TRUE(fs::exists(path("out/map.ply")));
}

TEST_F(Network, ADamagedMapIsLeftOutAndNamed) {
  Process h = hub(" --robots 3");  // one never comes
  for (const std::string name : {"a", "b"}) {
    fs::copy(world(name), path(name), fs::copy_options::recursive);
    Process process = start(name, "robot " + name + " --name " + name + network());
    ASSERT_EQ(process.wait(kLong_s), 0) << process.told() << h.told();
  }
  h.end(SIGKILL);

  const std::string copy = path("out.partial/robots/b/map.db").string();
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(copy.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, "UPDATE keyframe SET data = zeroblob(100) WHERE number = 1", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  EXPECT_EQ(sqlite3_changes(database), 1);
  sqlite3_close(database);

  const std::size_t first = h.told().size();
  h = hub(" --robots 3 --resume");
  const auto waits = [&] { return h.told().find("waiting for", first) != std::string::npos; };
  ASSERT_TRUE(happens(waits, kLong_s)) << h.told();
  h.send(SIGINT);
  EXPECT_EQ(h.wait(kLong_s), 4) << h.told();
  EXPECT_NE(h.told().find("b is left out: "), std::string::npos) << h.told();
  EXPECT_NE(h.told().find("robots/b/map.db: damaged"), std::string::npos) << h.told();
  EXPECT_TRUE(fs::exists(path("out/map.ply")));
}

TEST_F(Network, ARobotThatHearsNobodySaysHowToHandIn) {
  fs::copy(world("a"), path("a"), fs::copy_options::recursive);
  Process a = start("a", "robot a --name a --wait 1" + network());
  EXPECT_EQ(a.wait(kLong_s), 0) << a.told();
  EXPECT_NE(a.told().find("plumbline robot 'a' --name a --domain"), std::string::npos) << a.told();
  for (const std::string name : {"../a", "-a", "a/b", "''"}) {
    Process bad = start("bad", "robot a --wait 1 --name=" + name + network());
    EXPECT_EQ(bad.wait(kLong_s), 2) << bad.told();
  }
}

TEST_F(Network, AHubThatIsLostIsToldWithTheCommand) {
  Process h = hub();
  Process a = robot("a", " --pace 5 --wait-lost 1");
  const fs::path copy = path("out.partial/robots/a/map.db");
  ASSERT_TRUE(happens([&] { return fs::exists(copy); }, kLong_s)) << h.told();
  usleep(1500000);  // it speaks, too
  h.end(SIGKILL);
  EXPECT_EQ(a.wait(kLong_s), 4) << a.told();
  EXPECT_NE(a.told().find("plumbline robot 'a' --name a"), std::string::npos) << a.told();
  EXPECT_EQ(slurp(path("a/map.db")), slurp(world("a") / "map.db"));
}

TEST_F(Network, AFullDiskAtTheHubIsToldOnBothSides) {
  // The shell's file size limit stands in for the disk's end, in blocks of 512 or 1024 bytes.
  Process h = hub(" --robots 2", "ulimit -f 700;");
  fs::copy(world("a"), path("a"), fs::copy_options::recursive);
  Process a = start("a", "robot a --name a --wait-lost 4" + network());
  EXPECT_EQ(a.wait(kLong_s), 4) << a.told() << h.told();
  EXPECT_NE(a.told().find("a cannot be stored at the hub"), std::string::npos) << a.told();
  EXPECT_NE(h.told().find("a cannot be stored at the hub"), std::string::npos) << h.told();
  h.end(SIGKILL);
  h = hub(" --robots 1 --resume");  // there is room again
  Process again = start("again", "robot a --name a" + network());
  EXPECT_EQ(again.wait(kLong_s), 0) << again.told() << h.told();
  EXPECT_EQ(h.wait(kLong_s), 0) << h.told();
  EXPECT_EQ(dump(path("out/robots/a/map.db")), dump(path("a/map.db")));
}

TEST_F(Network, ARobotWhoseCameraTurnsOutToBeAnotherIsFollowed) {
  const Outcome made = run("synth room -o filmed --frames 90 --fps 15 --reference-spacing 10cm -q");
  ASSERT_EQ(made.code, 0) << made;
  const fs::path recording = path("filmed/robot0");
  std::string camera = slurp(recording / "camera.yaml");
  for (const std::string key : {"\nfx: ", "\nfy: "}) {
    const std::size_t at = camera.find(key) + key.size();
    const std::size_t end = camera.find('\n', at);
    camera.replace(at, end - at, std::to_string(1.02 * std::stod(camera.substr(at, end - at))));
  }
  write("long.yaml", camera);
  Process h = hub(" --robots 1");
  Process a = start("a", "robot " + recording.string() + " --camera long.yaml --pace 15 -o a --name a" +
                             network() + " --set cloud.filters=[]");
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  EXPECT_NE(a.told().find("the camera is better"), std::string::npos) << a.told();
  EXPECT_EQ(dump(path("out/robots/a/map.db")), dump(path("a/map.db")));
  EXPECT_TRUE(read_json(path("out/summary.json"))["network"]["a"]["delivered"]);
  const std::string log = slurp(path("out/hub.log"));
  EXPECT_EQ(log.find("a: has lost transactions"), std::string::npos) << "it is one run: " << log;
}

}  // namespace
}  // namespace plumbline::integration
