// SPDX-License-Identifier: BSD-3-Clause
// Keys: who has them gets everything, who has none or others' gets nothing, and hears of it.
#include <sys/stat.h>

#include "network/network_test.hpp"

namespace plumbline::integration {
namespace {

class Keys : public NetworkTest {
 protected:
  Keys() {
    EXPECT_EQ(run("keys create keys --robots a,b").code, 0);
    for (const char* name : {"a", "b"}) fs::copy(world(name), path(name), fs::copy_options::recursive);
  }
  [[nodiscard]] Process hand_in(const std::string& name, const std::string& more) const {
    return start(name, "robot " + name + " --name " + name + network() + more);
  }
};

TEST_F(Keys, FoldersAreCompleteAndPrivate) {
  for (const auto& entry : fs::recursive_directory_iterator(path("keys"))) {
    struct stat status {};
    ASSERT_EQ(stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, entry.is_directory() ? 0700U : 0600U) << entry.path();
  }
  EXPECT_EQ(run("keys create keys --robots c").code, 2) << "nothing is replaced";
  EXPECT_EQ(run("keys add keys --robots a").code, 2);
  EXPECT_EQ(run("keys add keys --robots c").code, 0);
  EXPECT_EQ(run("keys add keys --robots ../c").code, 2);
  EXPECT_EQ(run("keys revoke keys --robots d").code, 2);
  EXPECT_EQ(run("keys create other --robots ca").code, 2);
  EXPECT_EQ(run("robot a --name a --security keys/none" + network()).code, 2);
  for (const char* file :
       {"key.pem", "certificate.pem", "ca.pem", "governance.p7s", "permissions.p7s", "crl.pem"}) {
    EXPECT_TRUE(fs::exists(path("keys/c") / file)) << file;
  }
  EXPECT_FALSE(fs::exists(path("keys/hub/ca_key.pem")));
}

TEST_F(Keys, WhoHasThemGivesTheBytesOfFuse) {
  Process h = hub(" --robots 2 --security keys/hub");
  Process a = hand_in("a", " --security keys/a");
  Process b = hand_in("b", " --security keys/b");
  ASSERT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
  ASSERT_EQ(b.wait(kLong_s), 0) << b.told() << h.told();
  ASSERT_EQ(h.wait(kLong_s), 0) << h.told();
  EXPECT_EQ(slurp(path("out/map.ply")), slurp(world("ab/map.ply")));
}

TEST_F(Keys, WhoHasNoneOrOthersGetsNothing) {
  ASSERT_EQ(run("keys create foreign --robots b").code, 0);
  ASSERT_EQ(run("keys add keys --robots c").code, 0);
  fs::copy(path("keys/c"), path("old"), fs::copy_options::recursive);
  ASSERT_EQ(run("keys revoke keys --robots c").code, 0);
  Process h = hub(" --robots 2 --security keys/hub");
  // Another robot's keys are refused by this robot's own end.
  Process stolen = start("stolen", "robot b --name b" + network() + " --security keys/a");
  EXPECT_EQ(stolen.wait(20.0), 2) << stolen.told();
  fs::copy(path("b"), path("c"), fs::copy_options::recursive);
  Process none = start("none", "robot b --name b --wait 13" + network());
  Process foreign = start("foreign", "robot c --name b --wait 13" + network() + " --security foreign/b");
  fs::copy(path("b"), path("d"), fs::copy_options::recursive);
  Process revoked = start("revoked", "robot d --name c --wait 13" + network() + " --security old");
  Process knows = start("knows", "robot d --name c" + network() + " --security keys/c");
  EXPECT_EQ(knows.wait(20.0), 2) << knows.told();
  EXPECT_NE(knows.told().find("revoked"), std::string::npos) << knows.told();
  for (Process* process : {&none, &foreign, &revoked}) {
    EXPECT_EQ(process->wait(60.0), 0) << process->told();
    EXPECT_NE(process->told().find("no answer in 10 s"), std::string::npos) << process->told();
    EXPECT_NE(process->told().find("To send it later"), std::string::npos) << process->told();
  }
  EXPECT_FALSE(fs::exists(path("out.partial/robots/b")));
  EXPECT_FALSE(fs::exists(path("out.partial/robots/c")));
  Process a = hand_in("a", " --security keys/a");
  EXPECT_EQ(a.wait(kLong_s), 0) << a.told() << h.told();
}

}  // namespace
}  // namespace plumbline::integration
