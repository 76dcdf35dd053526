-- Which assets take longest, and in which stage?
SELECT asset_id, category, round(seconds_total, 1) AS s, replace(arg_max(stage, seconds), 'seconds_', '') AS "most in",
    round(max(seconds), 1) AS "s there", n_joints AS joints
FROM (UNPIVOT assets ON COLUMNS('seconds_(extract|synthesize|validate|apply|refine|measure)') INTO NAME stage VALUE seconds)
GROUP BY ALL ORDER BY s DESC LIMIT 5
