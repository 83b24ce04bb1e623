//! rosbag2 in SQLite: tables `topics` and `messages`.

use super::bag::Collector;
use super::sqlite::{Database, Value};
use crate::error::{Error, Result, Warning, WarningKind};
use std::collections::HashMap;
use std::path::Path;

pub(super) fn read(path: &Path, bag: &mut Collector) -> Result<()> {
    let mut db = Database::open(path)?;
    let mut table = |name: &str| {
        db.table(name)?.ok_or_else(|| {
            let message = format!("the database has no table `{name}`: it is no rosbag2 recording");
            Error::file(path, "", message)
        })
    };
    let (topics, topic_columns) = table("topics")?;
    let (messages, message_columns) = table("messages")?;
    let mut wal = path.as_os_str().to_owned();
    wal.push("-wal");
    if std::fs::metadata(&wal).is_ok_and(|m| m.len() > 0) {
        bag.warnings.push(Warning::new(
            WarningKind::RowsLeftOut,
            path.display().to_string(),
            "a write-ahead log (-wal) stands beside it, which is not read: its last messages are missing \
             (`sqlite3 FILE 'PRAGMA wal_checkpoint'` moves them in)",
        ));
    }
    let at = |columns: &[String], name: &str| {
        columns
            .iter()
            .position(|c| c.eq_ignore_ascii_case(name))
            .ok_or_else(|| {
                Error::file(
                    path,
                    "",
                    format!("the database has no column `{name}`: it is no rosbag2 recording"),
                )
            })
    };
    let (name, kind, encoding) = (
        at(&topic_columns, "name")?,
        at(&topic_columns, "type")?,
        at(&topic_columns, "serialization_format")?,
    );
    let mut known = HashMap::new();
    db.rows(topics, &mut |id, row| {
        let text = |k: usize| match row.get(k) {
            Some(Value::Text(t)) => t.clone(),
            _ => String::new(),
        };
        known.insert(id, bag.topic(&text(name), &text(kind), &text(encoding)));
        Ok(())
    })?;
    let (topic, stamp, data) = (
        at(&message_columns, "topic_id")?,
        at(&message_columns, "timestamp")?,
        at(&message_columns, "data")?,
    );
    let mut enough = false;
    db.rows(messages, &mut |_, row| {
        if enough {
            return Ok(());
        }
        if let (Some(Value::Integer(topic)), Some(Value::Integer(stamp)), Some(Value::Blob(data))) =
            (row.get(topic), row.get(stamp), row.get(data))
            && let Some(topic) = known.get(topic)
        {
            bag.message(*topic, *stamp, data);
        }
        enough = bag.flush()?.is_break();
        Ok(())
    })
}
