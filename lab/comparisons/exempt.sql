-- Which objects pass the reset check through an exemption alone: a start that has the energy to topple them, or a fall that no hinge brakes?
SELECT
    i.asset_id,
    bool_or(i.reason LIKE '%which a rise of%') AS topples,
    bool_or(i.reason LIKE '%cannot brake this fall%') AS slips
FROM interactions i JOIN assets a USING (asset_id)
WHERE a.status = 'ok' AND i.test = 'reset' AND i.passed
    AND (i.reason LIKE '%which a rise of%' OR i.reason LIKE '%cannot brake this fall%')
GROUP BY i.asset_id
