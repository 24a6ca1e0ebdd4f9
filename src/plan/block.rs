//! Blocks of episodes: what planning has finished, plans and drops alike, as a table and back.

use super::{Plan, from_table, to_table};
use crate::robot::Robot;
use crate::table::{Table, Values};
use crate::task::Task;
use std::ops::Range;
use std::sync::Arc;

/// Episodes of a block. Few enough that little is lost when planning is stopped (some tenths of a second of work; minutes of the hardest
/// scenes), enough that a table whose row groups are blocks packs well: some 10,000 rows.
const EPISODES: u64 = 64;
/// The column that tells drops from plans.
const DROPPED: &str = "dropped";

/// Episodes that follow each other, the same for any number of threads and machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Block {
    number: u64,
    first: u64,
    end: u64,
}

impl Block {
    /// The blocks of so many episodes; the last may be shorter.
    pub fn all(episodes: u64) -> impl Iterator<Item = Block> {
        let of = move |number| Block { number, first: number * EPISODES, end: ((number + 1) * EPISODES).min(episodes) };
        (0..episodes.div_ceil(EPISODES)).map(of)
    }

    /// Its place among the blocks.
    pub fn number(self) -> u64 {
        self.number
    }

    /// Its episodes.
    pub fn episodes(self) -> Range<u64> {
        self.first..self.end
    }

    /// The name of its file.
    pub fn file_name(self) -> String {
        format!("episodes-{:05}-{:05}.parquet", self.first, self.end - 1)
    }
}

/// The episodes of a block, planned: by number, each with its plan or the reason why it has none.
pub type Planned = Vec<(u64, Result<Plan, String>)>;

/// As a table: the rows of [`to_table`] with a column `dropped`; behind them a row for each episode without a plan, with the reason there.
pub fn block_to_table(robot: &Robot, planned: Planned) -> Table {
    let (mut plans, mut numbers, mut reasons) = (Vec::new(), Vec::new(), Vec::new());
    for (number, planned) in planned {
        match planned {
            Ok(plan) => plans.push(plan),
            Err(reason) => {
                numbers.push(number as i64);
                reasons.push(reason);
            }
        }
    }
    let mut table = to_table(robot, &plans);
    let waypoints = table.rows();
    let rows = waypoints + reasons.len();
    for column in &mut table.columns {
        match &mut column.values {
            Values::I64(v) if column.name == "episode" => v.extend(&numbers),
            Values::I64(v) => v.resize(rows, 0),
            Values::Text(v) => v.resize(rows, String::new()),
            Values::F64(v) => v.resize(rows, 0.0),
            Values::F32(_) | Values::Bool(_) => unreachable!("a table of plans has no such column"),
        }
    }
    let dropped = vec![String::new(); waypoints].into_iter().chain(reasons).collect();
    table.with(DROPPED, "Why the episode has no plan, empty on the rows of plans.", Values::Text(dropped))
}

/// The inverse of [`block_to_table`], of plans of `robot` in `task`, by number.
///
/// # Errors
/// As [`from_table`]; when the episodes are not those of `block`.
pub fn block_from_table((robot, task): (&Arc<Robot>, &Arc<Task>), block: Block, mut table: Table) -> Result<Planned, String> {
    let Some(Values::Text(dropped)) = table.columns.pop().filter(|c| c.name == DROPPED).map(|c| c.values) else {
        return Err(format!("its last column is not {DROPPED}: this is no block of plans"));
    };
    let waypoints = dropped.iter().take_while(|reason| reason.is_empty()).count();
    let mut numbers = Vec::new();
    for column in &mut table.columns {
        match &mut column.values {
            Values::I64(v) if column.name == "episode" => numbers = v.split_off(waypoints.min(v.len())),
            Values::I64(v) => v.truncate(waypoints),
            Values::Text(v) => v.truncate(waypoints),
            Values::F64(v) => v.truncate(waypoints),
            Values::F32(v) => v.truncate(waypoints),
            Values::Bool(v) => v.truncate(waypoints),
        }
    }
    let drops = numbers.into_iter().map(|number| number as u64).zip(dropped.into_iter().skip(waypoints).map(Err));
    let mut planned: Planned =
        from_table(robot, task, &table)?.into_iter().map(|plan| (plan.index, Ok(plan))).chain(drops).collect();
    planned.sort_by_key(|(number, _)| *number);
    if planned.iter().map(|(number, _)| *number).eq(block.episodes()) {
        return Ok(planned);
    }
    Err(format!("its episodes are not {} to {}", block.first, block.end - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{PlanSettings, SceneSettings};
    use crate::plan::Planner;
    use crate::robot::file::built_in::paper_robot;
    use crate::seed::stream;
    use crate::task::built_in::pick_up;
    use crate::tasks::draw_scene;

    #[test]
    fn blocks_hold_all_episodes_once() {
        for episodes in [1, EPISODES - 1, EPISODES, EPISODES + 1, 300] {
            assert!(Block::all(episodes).flat_map(Block::episodes).eq(0..episodes), "{episodes}");
        }
        assert_eq!(Block::all(100).nth(1).map(Block::file_name).as_deref(), Some("episodes-00064-00099.parquet"));
    }

    #[test]
    fn a_table_holds_a_block_exactly_and_another_block_is_refused() {
        let scenes = SceneSettings::default();
        let (robot, task) = (paper_robot(), pick_up());
        let mut planner = Planner::new(&robot, &task, &PlanSettings::default());
        let mut plan = |index| {
            let scene = draw_scene(&robot, &task, &scenes, &mut stream(0, "scene", index)).expect("there is room");
            planner.plan(index, &scene, &mut stream(0, "search", index)).map_err(|e| e.to_string())
        };
        let block = Block::all(3).next().expect("a block");
        let mixed: Planned = vec![(0, Err("no grasp".into())), (1, plan(1)), (2, Err("no way".into()))];
        let none: Planned = (0..3).map(|number| (number, Err(format!("episode {number}")))).collect();
        let all: Planned = (0..3).map(|number| (number, plan(number))).collect();
        for planned in [mixed, none, all] {
            let table = block_to_table(&robot, planned.clone());
            assert_eq!(block_from_table((&robot, &task), block, table.clone()), Ok(planned));
            let other = Block::all(2).next().expect("a block");
            assert!(block_from_table((&robot, &task), other, table).expect_err("one more").contains("not 0 to 1"));
        }
    }
}
