// A joint trajectory as an action of ROS 2, sent with roslibjs under Node: npm install roslib, then
//
//     iiwa-sim --rosbridge-port 9090
//     node examples/ros2_roslibjs.mjs ws://127.0.0.1:9090

import { Action, Ros, Topic } from "roslib";

const ros = new Ros({ url: process.argv[2] });
await new Promise((connected, failed) => {
  ros.on("connection", connected);
  ros.on("error", failed);
});
const told = (ask) => new Promise((done, failed) => ask(done, failed));

const [name] = await told((...then) => ros.getActionServers(...then));
console.log("action", name);
const action = new Action({ ros, name, actionType: "control_msgs/action/FollowJointTrajectory" });
const joint_names = ["A1", "A2", "A3", "A4", "A5", "A6", "A7"];
const point = (sec, positions) => ({ positions, time_from_start: { sec, nanosec: 0 } });

/** Send a goal; `id` names it, `feedback` and `end` are told when there is some. */
const send = (...points) => {
  const goal = {};
  goal.feedback = new Promise((heard) => {
    goal.end = new Promise((ended) => {
      const result = ({ error_code }) => ended(`reached, ${error_code}`);
      goal.id = action.sendGoal({ trajectory: { joint_names, points } }, result, heard, ended);
    });
  });
  return goal;
};

const there = send(point(5, [0.2, 0.4, 0, -1.2, 0, 1.4, 0]), point(6, [0, 0.5236, 0, -1.0472, 0, 1.5708, 0]));
console.log("feedback of", (await there.feedback).joint_names.join(" "));
console.log(await there.end);

const far = send(point(20, [1.0, 0.4, 0, -1.2, 0, 1.4, 0]));
await far.feedback;
action.cancelGoal(far.id);
console.log(await far.end);

const farther = send(point(20, [1.0, 0.4, 0, -1.2, 0, 1.4, 0]));
await farther.feedback;
action.cancelAllGoals();
console.log(await farther.end);

console.log(await send(point(1, joint_names.map(() => 9.0))).end);

// From its first goal on, this client is told everything as ROS 2 has it.
console.log("type", await told((...then) => ros.getTopicType("/joint_states", ...then)));
const states = new Topic({ ros, name: "/joint_states", messageType: "sensor_msgs/msg/JointState" });
const { header } = await told((done) => states.subscribe(done));
console.log("stamp", Object.keys(header.stamp).join(" "));
ros.close();
